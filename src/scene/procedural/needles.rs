//! The worst case for a bounding volume hierarchy of axis-aligned boxes: long thin triangles along the
//! diagonals of a cube. Every box is nearly the whole cube and overlaps every other.

use super::mesh::{Builder, Frame};
use super::random::Random;
use crate::scene::{LightKind, Scene};
use glam::Vec3;

/// Exactly `triangles` needles in the cube -1..1. Their width falls so that together they keep covering
/// about the same share of a view.
pub fn build(triangles: usize, seed: u64) -> Scene {
    let mut builder = Builder::with_attributes("needles", triangles, false, false);
    let steel = builder.matte("needle", [0.55, 0.58, 0.62]);
    let mut random = Random::new(seed);
    let half_width = 0.3 / (triangles as f32).sqrt();
    for _ in 0..triangles {
        let centre = random.in_cube() * 0.5;
        // Components of 0.35 to 0.49 keep both ends inside the cube and the direction diagonal.
        let mut component = || random.between(0.35, 0.49) * random.pick(&[-1.0, 1.0]);
        let half = Vec3::new(component(), component(), component());
        let across = Frame::along(centre, half.normalize()).axes[0] * half_width;
        builder.flat_triangle(steel, [centre - half - across, centre - half + across, centre + half]);
    }
    builder.camera(Vec3::new(2.2, 1.6, 3.0), Vec3::ZERO, 36.0);
    let direction = Vec3::new(-0.5, -1.0, -0.4).normalize();
    builder.light("sun", [3.0, 2.9, 2.7], LightKind::Directional { direction });
    builder.finish()
}
