//! Meshes and rays that methods are driven with.

use glam::Vec3;

use crate::bvh::{Bvh, Quality};
use crate::layout::Ray;
use crate::scene::procedural::random::Random;
use crate::shared::FAR_AWAY;
use crate::{Result, scene};

/// Triangles.
pub type Positions = Vec<[Vec3; 3]>;

/// A closed convex mesh: two pyramids of `sides` triangles on a common ring around `centre`. Corners are rounded after
/// they are moved there, and shared bit for bit.
pub fn bipyramid(sides: u32, radius: f32, centre: Vec3) -> Positions {
    let corner = |k: u32| {
        let angle = std::f64::consts::TAU * f64::from(k % sides) / f64::from(sides);
        centre + Vec3::new(angle.cos() as f32, angle.sin() as f32, 0.0) * radius
    };
    let tips = [Vec3::Z, Vec3::NEG_Z].map(|tip| centre + tip * radius);
    let side = |k| [[tips[0], corner(k), corner(k + 1)], [tips[1], corner(k + 1), corner(k)]];
    (0..sides).flat_map(side).collect()
}

/// The tree over a mesh at default quality.
pub fn tree(positions: &Positions) -> Result<Bvh> {
    let floored: Positions = positions.iter().map(|corners| corners.map(scene::floored)).collect();
    Bvh::build(&floored, Quality::default())
}

/// A ray without end, of unit direction.
pub fn ray(origin: Vec3, towards: Vec3) -> Ray {
    let direction = towards.try_normalize().unwrap_or(Vec3::X);
    Ray { origin: origin.into(), t_min: 0.0, direction: direction.into(), t_max: FAR_AWAY }
}

/// Ray `index` from the inside of a mesh around `centre`, towards a corner, a point of an edge or anywhere.
pub fn ray_inside(positions: &Positions, (centre, radius): (Vec3, f32), index: u64) -> Ray {
    let random = &mut Random::stream(1, index);
    let origin = centre + random.in_cube() * (0.2 * radius);
    let [a, b, _] = random.pick(positions);
    match index % 4 {
        0 => ray(origin, a - origin),
        1 | 2 => ray(origin, a.lerp(b, random.unit()) - origin),
        _ => ray(origin, random.direction()),
    }
}

/// Ray `index` from around a tree, towards a ball of `spread` times its half diagonal in its middle.
pub fn ray_outside(bvh: &Bvh, spread: f32, index: u64) -> Ray {
    let random = &mut Random::stream(2, index);
    let (low, high) = bvh.bounds;
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low).length());
    let origin = middle + random.direction() * (2.0 * half);
    ray(origin, middle + random.in_ball() * (spread * half) - origin)
}
