//! Twin of `sampling.glsl`: directions from random numbers, by additions and products alone.

use glam::{Vec2, Vec3};

use super::exact::{exact_rcp, exact_sqrt};
use super::vec::normalize3;

fn quarter_cos_sin(x: f32) -> Vec2 {
    let y = x * std::f32::consts::FRAC_PI_2;
    let z = y * y;
    let c = 1.0 + z * (-0.5 + z * (0.041_666_668 + z * (-0.001_388_888_9 + z * (2.480_158_7e-5 + z * -2.755_732e-7))));
    let s = y * (1.0 + z * (-0.166_666_67 + z * (0.008_333_334 + z * (-0.000_198_412_7 + z * 2.755_732e-6))));
    Vec2::new(c, s)
}

/// Cosine and sine of `u` turns, 0 <= u < 1.
pub fn turn_cos_sin(u: f32) -> Vec2 {
    let quarters = u * 4.0;
    let nearest = (quarters + 0.5) as u32;
    let p = quarter_cos_sin(quarters - nearest as f32);
    match nearest & 3 {
        0 => p,
        1 => Vec2::new(-p.y, p.x),
        2 => Vec2::new(-p.x, -p.y),
        _ => Vec2::new(p.y, -p.x),
    }
}

/// Cosine-weighted direction about the unit vector `n`.
pub fn cosine_direction(n: Vec3, u: Vec2) -> Vec3 {
    let turn = turn_cos_sin(u.y);
    let r = exact_sqrt(u.x);
    let (x, y, z) = (r * turn.x, r * turn.y, exact_sqrt((1.0 - u.x).max(0.0)));
    let side = if n.z < 0.0 { -1.0 } else { 1.0 };
    let a = -exact_rcp(side + n.z);
    let b = n.x * n.y * a;
    let tangent = Vec3::new(1.0 + side * n.x * n.x * a, side * b, -side * n.x);
    let bitangent = Vec3::new(b, side + n.y * n.y * a, -n.y);
    normalize3(tangent * x + bitangent * y + n * z)
}

/// Uniform direction on the unit sphere.
pub fn sphere_direction(u: Vec2) -> Vec3 {
    let turn = turn_cos_sin(u.y);
    let z = 1.0 - 2.0 * u.x;
    let r = exact_sqrt((1.0 - z * z).max(0.0));
    Vec3::new(r * turn.x, r * turn.y, z)
}
