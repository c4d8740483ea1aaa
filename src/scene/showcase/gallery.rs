//! A room that shows the materials: a row of spheres on pedestals under a spot light, a checkered floor
//! and a picture on the wall.

use super::{glass, metal, standing_block};
use crate::scene::procedural::mesh::{Builder, Frame};
use crate::scene::procedural::sphere::sphere;
use crate::scene::procedural::surface::rectangle;
use crate::scene::procedural::trig::sin_cos;
use crate::scene::{LightKind, Material, Scene, Texture, Wrap};
use glam::{Vec2, Vec3};

const HALF_WIDTH: f32 = 4.2;
const HEIGHT: f32 = 3.2;
/// The room reaches from `BACK` to `FRONT` along z.
const BACK: f32 = -2.4;
const FRONT: f32 = 4.4;
const PEDESTAL: f32 = 0.8;
const RADIUS: f32 = 0.34;

pub fn build() -> Scene {
    let mut builder = Builder::with_attributes("gallery", 9_000, true, true);
    room(&mut builder);
    let stone = builder.matte("pedestal", [0.62, 0.61, 0.59]);
    for (index, (name, material)) in exhibits().into_iter().enumerate() {
        // A shallow arc of eight that opens towards the camera.
        let offset = index as f32 - 3.5;
        let foot = Vec3::new(offset * 0.86, 0.0, 0.055 * offset * offset - 0.9);
        standing_block(&mut builder, stone, &Frame::at(foot), [0.52, PEDESTAL, 0.52]);
        let material = builder.material(name, material);
        sphere(&mut builder, material, foot + Vec3::Y * (PEDESTAL + RADIUS), RADIUS, 9);
    }

    builder.camera(Vec3::new(0.0, 1.6, 7.0), Vec3::new(0.0, 1.3, -0.2), 40.0);
    lights(&mut builder);
    builder.finish()
}

/// From left to right.
fn exhibits() -> [(&'static str, Material); 8] {
    let plain = |base_color, roughness| Material { base_color, roughness, ..Material::default() };
    [
        ("clay", plain([0.62, 0.22, 0.13], 1.0)),
        ("glossy blue", plain([0.05, 0.16, 0.52], 0.1)),
        ("gold", metal([1.0, 0.77, 0.34], 0.25)),
        ("mirror", metal([0.96, 0.96, 0.97], 0.0)),
        ("glass", glass()),
        ("tinted glass", Material { base_color: [0.55, 0.85, 0.70], ior: 1.33, ..glass() }),
        ("glowing", Material { base_color: [0.2, 0.2, 0.2], emissive: [2.4, 1.3, 0.45], ..Material::default() }),
        ("unlit", Material { base_color: [0.20, 0.55, 0.62], unlit: true, ..Material::default() }),
    ]
}

/// Open towards the camera, which stands outside.
fn room(builder: &mut Builder) {
    let (x, top, back, front) = (HALF_WIDTH, HEIGHT, BACK, FRONT);
    let wall = builder.matte("wall", [0.68, 0.66, 0.63]);
    let mut flat = |corners: [[f32; 3]; 4]| builder.quad(wall, corners.map(Vec3::from));
    flat([[-x, top, back], [x, top, back], [x, top, front], [-x, top, front]]);
    flat([[-x, 0.0, back], [x, 0.0, back], [x, top, back], [-x, top, back]]);
    flat([[-x, 0.0, front], [-x, 0.0, back], [-x, top, back], [-x, top, front]]);
    flat([[x, 0.0, back], [x, 0.0, front], [x, top, front], [x, top, back]]);

    let checker = textured(builder, "checkered floor", checker());
    let half_depth = (front - back) * 0.5;
    let floor = rectangle(Frame::at(Vec3::Z * (front + back) * 0.5), x, half_depth);
    builder.sheet(checker, 2.0, 16, |u, v| {
        let vertex = floor(u, v);
        // One texture repeat a metre: it holds two by two tiles.
        crate::scene::procedural::mesh::Vertex { uv: vertex.uv * Vec2::new(2.0 * x, 2.0 * half_depth), ..vertex }
    });

    let frame = builder.material("picture frame", metal([0.80, 0.62, 0.30], 0.4));
    let picture = textured(builder, "picture", rings());
    let centre = Frame::at(Vec3::new(0.0, 2.3, back + 0.02));
    builder.block(frame, &centre, Vec3::new(0.78, 0.58, 0.02));
    // Turned so that the rectangle's +y looks into the room.
    let canvas = Frame { axes: [Vec3::X, Vec3::Z, Vec3::NEG_Y], ..centre.shifted(Vec3::Z * 0.025) };
    builder.sheet(picture, 1.0, 2, rectangle(canvas, 0.72, 0.52));
}

fn textured(builder: &mut Builder, name: &str, texture: Texture) -> u32 {
    let texture = builder.texture(texture);
    builder.material(name, Material { base_color_texture: Some(texture), roughness: 0.6, ..Material::default() })
}

fn checker() -> Texture {
    const SIZE: u32 = 32;
    let tile = |x: u32, y: u32| {
        let joint = x.is_multiple_of(SIZE / 2) || y.is_multiple_of(SIZE / 2);
        match ((x / (SIZE / 2) + y / (SIZE / 2)) % 2, joint) {
            (_, true) => [96, 90, 84, 255],
            (0, false) => [214, 206, 192, 255],
            _ => [122, 104, 92, 255],
        }
    };
    paint(SIZE, SIZE, Wrap::Repeat, tile)
}

/// Concentric rings about two centres, in four colours.
fn rings() -> Texture {
    const COLORS: [[u8; 4]; 4] = [[28, 52, 84, 255], [222, 168, 64, 255], [196, 74, 48, 255], [238, 228, 206, 255]];
    paint(72, 52, Wrap::Clamp, |x, y| {
        let point = Vec2::new(x as f32, y as f32);
        let wave = |centre: Vec2| sin_cos(point.distance(centre) / 18.0).0;
        let level = wave(Vec2::new(20.0, 30.0)) + wave(Vec2::new(54.0, 18.0));
        COLORS[((level + 2.0) as usize).min(3)]
    })
}

fn paint(width: u32, height: u32, wrap: Wrap, color: impl Fn(u32, u32) -> [u8; 4]) -> Texture {
    let texels = (0..width * height).map(|i| color(i % width, i / width)).collect();
    Texture { width, height, texels, wrap: [wrap; 2] }
}

fn lights(builder: &mut Builder) {
    let position = Vec3::new(-1.2, 3.0, 2.1);
    let (_, cos_inner) = sin_cos(18.0 / 360.0);
    let (_, cos_outer) = sin_cos(34.0 / 360.0);
    let direction = (Vec3::new(-0.3, 1.1, -0.8) - position).normalize();
    let kind = LightKind::Spot { position, direction, range: f32::INFINITY, cos_inner, cos_outer };
    builder.light("spot", [26.0, 24.0, 20.5], kind);
    for x in [-2.4, 2.4] {
        let position = Vec3::new(x, 2.3, 3.7);
        builder.light("fill", [8.6, 8.9, 9.6], LightKind::Point { position, range: f32::INFINITY });
    }
}
