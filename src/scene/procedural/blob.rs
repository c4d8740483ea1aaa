//! A dense smooth closed object, like a scanned statue: a sphere displaced by noise, on a ground plane.

use super::mesh::{Builder, Frame, Vertex};
use super::noise::fractal_noise;
use super::sphere::{closed_surface, closed_surface_triangles};
use super::surface::rectangle;
use crate::scene::{LightKind, Scene};
use glam::Vec3;

/// Exactly `triangles` triangles: the largest closed surface in 97 % of them, the ground in the rest.
pub fn build(triangles: usize, seed: u64) -> Scene {
    let mut builder = Builder::new("blob", triangles);
    let clay = builder.matte("clay", [0.72, 0.45, 0.30]);
    let ground = builder.matte("ground", [0.6, 0.6, 0.6]);

    let n = (triangles * 97 / 100 / closed_surface_triangles(1)).isqrt();
    closed_surface(&mut builder, clay, n, |unit| {
        // Radius 1 + h(unit). The normal is the gradient of |x| - 1 - h(x / |x|).
        let (noise, slope) = fractal_noise(unit * 1.7, 3, seed);
        let (height, slope) = (0.28 * noise, slope * (0.28 * 1.7));
        let radius = 1.0 + height;
        let along_surface = slope - unit * slope.dot(unit);
        let normal = unit - along_surface / radius;
        Vertex::new((unit * radius).as_vec3(), normal.normalize().as_vec3())
    });

    let below = Frame::at(Vec3::new(0.0, -1.3, 0.0));
    let rest = triangles - builder.triangles();
    builder.sheet(ground, 1.0, rest, rectangle(below, 8.0, 8.0));

    builder.camera(Vec3::new(1.4, 1.1, 4.2), Vec3::new(0.0, -0.15, 0.0), 38.0);
    let direction = Vec3::new(-0.6, -1.0, -0.5).normalize();
    builder.light("sun", [3.0, 2.85, 2.6], LightKind::Directional { direction });
    builder.finish()
}
