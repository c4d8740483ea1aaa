//! Twin of `triangle.glsl`: watertight ray-triangle test.

use glam::Vec3;

use super::box_test::{BoxRay, box_spans};
use super::exact::{exact_rcp, product_error};
use super::vec::floored;
use crate::layout::Triangle;
use crate::layout::{Hit, Ray};
use crate::shared::{COORDINATE_FLOOR, EDGE_FLOOR, PRODUCT_FLOOR, SHEAR_FLOOR};

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
    let shear = Vec3::new(floored(d[0] * inverse, SHEAR_FLOOR), floored(d[1] * inverse, SHEAR_FLOOR), inverse);
    Shear { axes, shear }
}

#[inline(always)]
fn sheared(corner: [f32; 3], ray: &Ray, shear: &Shear) -> Vec3 {
    // Spelt out: `map` over an array is a call where the optimiser does not inline it, two to three times slower.
    let [kx, ky, kz] = shear.axes;
    let (x, y, z) = (corner[kx] - ray.origin[kx], corner[ky] - ray.origin[ky], corner[kz] - ray.origin[kz]);
    Vec3::new(x - shear.shear.x * z, y - shear.shear.y * z, z)
}

#[inline(always)]
fn edge(a: Vec3, b: Vec3) -> f32 {
    a.x * b.y - a.y * b.x
}

#[cold]
fn refined(value: f32, a: Vec3, b: Vec3) -> f32 {
    let (p, q) = (a.x * b.y, a.y * b.x);
    if value.abs() > EDGE_FLOOR {
        value
    } else if p.abs() < PRODUCT_FLOOR {
        0.0
    } else {
        product_error(a.x, b.y, p) - product_error(a.y, b.x, q)
    }
}

#[inline(always)]
fn outside(u: f32, v: f32, w: f32, least: f32) -> bool {
    u.min(v).min(w) < -least && u.max(v).max(w) > least
}

/// Takes the triangle if it is hit nearer than `hit`, or as near with a lower primitive id.
#[inline(always)]
pub fn intersect(ray: &Ray, box_ray: &BoxRay, shear: &Shear, triangle: &Triangle, hit: &mut Hit) {
    let a = sheared(triangle.v0, ray, shear);
    let b = sheared(triangle.v1, ray, shear);
    let c = sheared(triangle.v2, ray, shear);
    let (mut u, mut v, mut w) = (edge(c, b), edge(a, c), edge(b, a));
    if outside(u, v, w, EDGE_FLOOR) {
        return;
    }
    if u.abs().min(v.abs()).min(w.abs()) <= EDGE_FLOOR {
        (u, v, w) = (refined(u, c, b), refined(v, a, c), refined(w, b, a));
        if outside(u, v, w, 0.0) {
            return;
        }
    }
    let det = u + v + w;
    if det == 0.0 {
        return;
    }
    let inverse = exact_rcp(det);
    // Weights first: u a.z is cubic in the size of the scene and would overflow early.
    let weight = |edge: f32| floored(edge * inverse, EDGE_FLOOR);
    let (u, v, w) = (weight(u), weight(v), weight(w));
    let t = floored(((u * a.z + v * b.z) + w * c.z) * shear.shear.z, COORDINATE_FLOOR);
    if t < ray.t_min || t > hit.t {
        return;
    }
    let (v0, v1, v2) = (Vec3::from(triangle.v0), Vec3::from(triangle.v1), Vec3::from(triangle.v2));
    let spans = box_spans(box_ray, v0.min(v1).min(v2), v0.max(v1).max(v2), ray.t_min, ray.t_max);
    let t = t.max(spans.enter0()).abs();
    if spans.hits().0 && (t < hit.t || (t == hit.t && triangle.prim < hit.prim)) {
        *hit = Hit { t, prim: triangle.prim, u: v, v: w };
    }
}
