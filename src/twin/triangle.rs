//! Twin of `triangle.glsl`: watertight ray-triangle test.

use glam::Vec3;

use super::box_test::{BoxRay, box_spans};
use super::exact::{exact_rcp, product_error};
use super::vec::{cross3, dot3, floored, floored3, max3};
use crate::layout::Triangle;
use crate::layout::{Hit, Ray};
use crate::shared::{
    COORDINATE_FLOOR, DEPTH_CONDITION, EDGE_FLOOR, FAR_AWAY, NORMAL_FLOOR, POINT_FLOOR, PRODUCT_FLOOR, SHEAR_FLOOR,
};

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

#[cold]
fn plane_depth(ray: &Ray, shear: &Shear, triangle: &Triangle, weights: Vec3, depth: f32) -> f32 {
    let v0 = Vec3::from(triangle.v0);
    let (e, f) = (Vec3::from(triangle.v1) - v0, Vec3::from(triangle.v2) - v0);
    let point = floored3((v0 - Vec3::from(ray.origin)) + (weights.y * e + weights.z * f), POINT_FLOOR);
    let exponent = max3(e.abs()).max(max3(f.abs())).to_bits() & 0x7F80_0000;
    let scale = f32::from_bits(0x7F00_0000 - exponent);
    let normal = floored3(cross3(e * scale, f * scale), NORMAL_FLOOR);
    let along = [shear.shear.x, shear.shear.y, 1.0];
    // The axes are swapped in pairs, so that swapping them again turns them back.
    let slope = dot3(normal, Vec3::from(shear.axes.map(|k| along[k])));
    if slope == 0.0 { depth } else { dot3(normal, point) * exact_rcp(slope) }
}

#[inline(always)]
fn hit_depth(ray: &Ray, shear: &Shear, triangle: &Triangle, [a, b, c]: [Vec3; 3], weights: Vec3, inverse: f32) -> f32 {
    let depth = (weights.x * a.z + weights.y * b.z) + weights.z * c.z;
    let largest = a.abs().max(b.abs()).max(c.abs());
    let range = a.z.max(b.z).max(c.z) - a.z.min(b.z).min(c.z);
    let cancelled = largest.x * largest.y * inverse.abs() * range > DEPTH_CONDITION * depth.abs();
    if cancelled { plane_depth(ray, shear, triangle, weights, depth) } else { depth }
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
    let (v0, v1, v2) = (Vec3::from(triangle.v0), Vec3::from(triangle.v1), Vec3::from(triangle.v2));
    let spans = box_spans(box_ray, v0.min(v1).min(v2), v0.max(v1).max(v2), -FAR_AWAY, FAR_AWAY);
    if !spans.hits().0 || spans.enter0() > hit.t {
        return;
    }
    let inverse = exact_rcp(det);
    // Weights first: an edge function times a coordinate is cubic in the size of the scene and would overflow early.
    let weights = floored3(Vec3::new(u, v, w) * inverse, EDGE_FLOOR);
    let depth = hit_depth(ray, shear, triangle, [a, b, c], weights, inverse);
    let t = floored(depth * shear.shear.z, COORDINATE_FLOOR).min(spans.leave0()).max(spans.enter0());
    if t < ray.t_min || t > hit.t {
        return;
    }
    let t = t.abs();
    if t < hit.t || triangle.prim < hit.prim {
        *hit = Hit { t, prim: triangle.prim, u: weights.y, v: weights.z };
    }
}
