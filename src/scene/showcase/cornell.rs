//! A room after the Cornell box: open at the front, one red and one green wall, a lamp in the ceiling, a
//! mirror, a glass sphere and a copper one. As wide as a 4:3 picture, which it fills.

use super::{glass, metal, standing_block};
use crate::scene::procedural::mesh::{Builder, Frame};
use crate::scene::procedural::sphere::sphere;
use crate::scene::{LightKind, Material, Scene};
use glam::Vec3;

const HALF_WIDTH: f32 = 1.6;
const HEIGHT: f32 = 2.4;
const HALF_DEPTH: f32 = 1.5;

pub fn build() -> Scene {
    let mut builder = Builder::new("cornell", 6_000);
    walls(&mut builder);
    lamp(&mut builder);

    let white = builder.matte("white plaster", [0.74, 0.72, 0.68]);
    let mirror = builder.material("mirror", metal([0.95, 0.95, 0.95], 0.0));
    let frame = builder.material("dark steel", metal([0.35, 0.36, 0.38], 0.35));
    let tall = Frame::turned(Vec3::new(-0.62, 0.0, -0.5), 0.088);
    standing_block(&mut builder, frame, &tall, [0.74, 0.05, 0.74]);
    standing_block(&mut builder, mirror, &tall.shifted(Vec3::Y * 0.05), [0.7, 1.4, 0.7]);

    let low = Frame::turned(Vec3::new(0.68, 0.0, -0.1), -0.045);
    standing_block(&mut builder, white, &low, [0.8, 0.36, 0.8]);
    let clear = builder.material("glass", glass());
    sphere(&mut builder, clear, Vec3::new(0.68, 0.36 + 0.38, -0.1), 0.38, 18);
    let copper = builder.material("copper", metal([0.95, 0.58, 0.42], 0.2));
    sphere(&mut builder, copper, Vec3::new(-0.05, 0.2, 0.62), 0.2, 12);

    // From here the opening at the front is a little wider and higher than the picture.
    let (eye_height, distance) = (HEIGHT * 0.5, 3.6);
    let eye = Vec3::new(0.0, eye_height, HALF_DEPTH + distance);
    builder.camera(eye, Vec3::new(0.0, eye_height, 0.0), 36.0);
    builder.finish()
}

fn walls(builder: &mut Builder) {
    let (x, y, z) = (HALF_WIDTH, HEIGHT, HALF_DEPTH);
    let white = builder.matte("white wall", [0.74, 0.72, 0.68]);
    let red = builder.matte("red wall", [0.62, 0.075, 0.05]);
    let green = builder.matte("green wall", [0.11, 0.38, 0.16]);
    let mut wall = |material, corners: [[f32; 3]; 4]| builder.quad(material, corners.map(Vec3::from));
    wall(white, [[-x, 0.0, z], [x, 0.0, z], [x, 0.0, -z], [-x, 0.0, -z]]);
    wall(white, [[-x, y, -z], [x, y, -z], [x, y, z], [-x, y, z]]);
    wall(white, [[-x, 0.0, -z], [x, 0.0, -z], [x, y, -z], [-x, y, -z]]);
    wall(red, [[-x, 0.0, z], [-x, 0.0, -z], [-x, y, -z], [-x, y, z]]);
    wall(green, [[x, 0.0, -z], [x, 0.0, z], [x, y, z], [x, y, -z]]);
}

/// A glowing panel in a frame that hangs from the ceiling. The point light sits within the frame, which
/// keeps it from burning out the ceiling beside it.
fn lamp(builder: &mut Builder) {
    const HALF: [f32; 2] = [0.46, 0.32];
    const DROP: f32 = 0.06;
    const RIM: f32 = 0.015;
    let warm = [1.0, 0.86, 0.68];
    let glow = builder.material(
        "lamp",
        // Black but for its glow: the light hangs so near that any reflection of it would be a firefly.
        Material { base_color: [0.0; 3], emissive: warm.map(|c| 4.0 * c), ..Material::default() },
    );
    let panel = Frame::at(Vec3::new(0.0, HEIGHT - 0.015, 0.0));
    let [x, z] = HALF;
    let corners = [[-x, -z], [x, -z], [x, z], [-x, z]];
    builder.quad(glow, corners.map(|[x, z]| panel.point(Vec3::new(x, 0.0, z))));

    let rim = builder.matte("lamp frame", [0.8, 0.78, 0.74]);
    let middle = HEIGHT - DROP * 0.5;
    for side in [-1.0, 1.0] {
        let across = Frame::at(Vec3::new(0.0, middle, side * (z + RIM)));
        builder.block(rim, &across, Vec3::new(x + 2.0 * RIM, DROP * 0.5, RIM));
        let along = Frame::at(Vec3::new(side * (x + RIM), middle, 0.0));
        builder.block(rim, &along, Vec3::new(RIM, DROP * 0.5, z));
    }
    let position = Vec3::new(0.0, HEIGHT - 0.055, 0.0);
    builder.light("lamp", warm.map(|c| 10.0 * c), LightKind::Point { position, range: f32::INFINITY });
}
