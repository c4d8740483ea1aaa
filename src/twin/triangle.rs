//! Twin of `triangle.glsl`: watertight ray-triangle test.

use glam::Vec3;

use super::box_test::{BoxRay, box_enter};
use super::exact::{exact_rcp, product_error};
use crate::layout::Triangle;
use crate::layout::{Hit, Ray};
use crate::shared::{DETERMINANT_FLOOR, SHEAR_FLOOR};

/// A ray prepared for triangle tests: the axes, the direction's largest swapped with the last, and the shear
/// along them.
#[derive(Clone, Copy, Debug)]
pub struct Shear {
    axes: [usize; 3],
    shear: Vec3,
}

/// Prepares a ray's direction.
#[inline(always)]
pub fn shear_of(direction: [f32; 3]) -> Shear {
    let [x, y, z] = direction.map(f32::abs);
    let axis = if x > y {
        if x > z { 0 } else { 2 }
    } else if y > z {
        1
    } else {
        2
    };
    let axes = [[2, 1, 0], [0, 2, 1], [0, 1, 2]][axis];
    let d = axes.map(|k| direction[k]);
    let inverse = exact_rcp(d[2]);
    Shear { axes, shear: Vec3::new(d[0] * inverse, d[1] * inverse, inverse) }
}

#[inline(always)]
fn floored(x: f32) -> f32 {
    if x.abs() < SHEAR_FLOOR { 0.0 } else { x }
}

#[inline(always)]
fn sheared(corner: [f32; 3], ray: &Ray, shear: &Shear) -> Vec3 {
    // Spelt out: `map` over an array is a call where the optimiser does not inline it, two to three times slower.
    let [kx, ky, kz] = shear.axes;
    let (x, y, z) = (corner[kx] - ray.origin[kx], corner[ky] - ray.origin[ky], corner[kz] - ray.origin[kz]);
    Vec3::new(floored(x - shear.shear.x * z), floored(y - shear.shear.y * z), z)
}

#[inline(always)]
fn determinant(a: Vec3, b: Vec3) -> f32 {
    a.x * b.y - a.y * b.x
}

#[cold]
fn determinant_of_errors(a: Vec3, b: Vec3) -> f32 {
    let difference = product_error(a.x, b.y, a.x * b.y) - product_error(a.y, b.x, a.y * b.x);
    if difference.abs() < DETERMINANT_FLOOR { 0.0 } else { difference }
}

#[inline(always)]
fn outside(u: f32, v: f32, w: f32) -> bool {
    u.min(v).min(w) < 0.0 && u.max(v).max(w) > 0.0
}

/// Takes the triangle if it is hit nearer than `hit`, or as near with a lower primitive id.
#[inline(always)]
pub fn intersect(ray: &Ray, box_ray: &BoxRay, shear: &Shear, triangle: &Triangle, hit: &mut Hit) {
    let a = sheared(triangle.v0, ray, shear);
    let b = sheared(triangle.v1, ray, shear);
    let c = sheared(triangle.v2, ray, shear);
    let (mut u, mut v, mut w) = (determinant(c, b), determinant(a, c), determinant(b, a));
    if outside(u, v, w) {
        return;
    }
    if u == 0.0 || v == 0.0 || w == 0.0 {
        u = if u == 0.0 { determinant_of_errors(c, b) } else { u };
        v = if v == 0.0 { determinant_of_errors(a, c) } else { v };
        w = if w == 0.0 { determinant_of_errors(b, a) } else { w };
        if outside(u, v, w) {
            return;
        }
    }
    let det = u + v + w;
    if det.abs() < DETERMINANT_FLOOR {
        return;
    }
    let inverse = exact_rcp(det);
    // Weights first: u a.z is cubic in the size of the scene and would overflow early.
    let (u, v, w) = (u * inverse, v * inverse, w * inverse);
    let t = ((u * a.z + v * b.z) + w * c.z) * shear.shear.z;
    if t < ray.t_min || t > hit.t {
        return;
    }
    let (v0, v1, v2) = (Vec3::from(triangle.v0), Vec3::from(triangle.v1), Vec3::from(triangle.v2));
    let enter = box_enter(box_ray, v0.min(v1).min(v2), v0.max(v1).max(v2), ray.t_min);
    let t = t.max(enter).abs();
    if t < hit.t || (t == hit.t && triangle.prim < hit.prim) {
        *hit = Hit { t, prim: triangle.prim, u: v, v: w };
    }
}
