//! Twin of `vec.glsl`: vector arithmetic in a fixed order of operations. `glam` stores the vectors; its
//! own dot, cross and normalize are not used because their order is theirs.

use glam::Vec3;

use super::exact::{exact_rcp, exact_sqrt};
use crate::shared::VECTOR_FLOOR;

/// Dot product, x and y first.
#[inline(always)]
pub fn dot3(a: Vec3, b: Vec3) -> f32 {
    (a.x * b.x + a.y * b.y) + a.z * b.z
}

/// Cross product.
#[inline(always)]
pub fn cross3(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
}

/// Largest component.
#[inline(always)]
pub fn max3(v: Vec3) -> f32 {
    v.x.max(v.y).max(v.z)
}

/// `x`, or zero if it is below `least` in magnitude.
#[inline(always)]
pub fn floored(x: f32, least: f32) -> f32 {
    if x.abs() < least { 0.0 } else { x }
}

/// [`floored`] by component.
#[inline(always)]
pub fn floored3(v: Vec3, least: f32) -> Vec3 {
    v.map(|x| floored(x, least))
}

/// Unit vector along `v`, or zero if `v` is zero or too short to tell ([`VECTOR_FLOOR`]).
#[inline(always)]
pub fn normalize3(v: Vec3) -> Vec3 {
    let largest = max3(v.abs());
    if largest < VECTOR_FLOOR {
        return Vec3::ZERO;
    }
    let v = v * exact_rcp(largest);
    v * exact_rcp(exact_sqrt(dot3(v, v)))
}
