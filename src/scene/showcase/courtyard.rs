//! A courtyard in the afternoon sun: an arcade on two sides, steps, cypresses and a fountain with a
//! bronze bowl and a glass ball.

use super::{glass, metal, standing_block};
use crate::scene::procedural::mesh::{Builder, Frame, Vertex};
use crate::scene::procedural::sphere::sphere;
use crate::scene::procedural::surface::lathe;
use crate::scene::procedural::trig::sin_cos;
use crate::scene::{LightKind, Scene};
use glam::Vec3;

/// Distance between the axes of two columns, metres.
const BAY: f32 = 2.4;
/// Height of the arcade's floor over the yard: three steps.
const PLINTH: f32 = 0.45;
/// Height at which the arches spring, over the arcade's floor.
const SPRING: f32 = 2.5;
/// Half the clear width of an arch.
const ARCH: f32 = 0.98;
/// Height of the arcade's wall over its floor.
const TOP: f32 = 4.1;
/// Half the thickness of the arcade's wall.
const WALL: f32 = 0.2;
/// Depth of the walk behind the columns.
const WALK: f32 = 2.6;

pub fn build() -> Scene {
    let mut builder = Builder::new("courtyard", 10_000);
    let stone = Stone {
        plaster: builder.matte("plaster", [0.76, 0.62, 0.44]),
        marble: builder.matte("marble", [0.74, 0.72, 0.67]),
        roof: builder.matte("roof tile", [0.48, 0.17, 0.09]),
    };
    pavement(&mut builder);
    // Frames stand at the arcades' left ends, the yard on their +z side; the two meet in the corner.
    arcade(&mut builder, &stone, &Frame::at(Vec3::new(-3.6, 0.0, -4.0)), 4);
    arcade(&mut builder, &stone, &Frame::turned(Vec3::new(-4.0, 0.0, 6.0), 0.25), 4);
    corner(&mut builder, &stone);
    fountain(&mut builder, &stone, Vec3::new(0.6, 0.0, 0.3));
    let green = builder.matte("cypress", [0.045, 0.12, 0.045]);
    let tub = builder.matte("terracotta", [0.50, 0.20, 0.10]);
    for place in [[5.0, -1.9], [5.9, 0.1], [-2.7, -2.4]] {
        cypress(&mut builder, [green, tub], Vec3::new(place[0], 0.0, place[1]));
    }

    builder.camera(Vec3::new(5.4, 1.75, 7.6), Vec3::new(-0.35, 1.55, -0.6), 44.0);
    let direction = Vec3::new(-0.62, -0.85, -0.42).normalize();
    builder.light("sun", [3.2, 2.9, 2.4], LightKind::Directional { direction });
    builder.finish()
}

struct Stone {
    plaster: u32,
    marble: u32,
    roof: u32,
}

/// Square slabs in two greys with sunken joints.
fn pavement(builder: &mut Builder) {
    let tones = [builder.matte("light slab", [0.56, 0.52, 0.46]), builder.matte("dark slab", [0.40, 0.36, 0.31])];
    let earth = builder.matte("earth", [0.30, 0.24, 0.17]);
    let plane = |half: f32, y: f32| {
        [[-half, half], [half, half], [half, -half], [-half, -half]].map(|[x, z]| Vec3::new(x, y, z))
    };
    builder.quad(earth, plane(40.0, -0.02));
    const SLAB: f32 = 1.0;
    for row in -7..8_i32 {
        for column in -7..8_i32 {
            let centre = Vec3::new(column as f32, 0.0, row as f32) * SLAB;
            let tone = tones[(row + column).rem_euclid(2) as usize];
            builder.quad(tone, plane(0.49 * SLAB, 0.0).map(|corner| centre + corner));
        }
    }
}

/// `bays` arches over columns along the frame's +x, with steps in front, a wall behind and a roof.
fn arcade(builder: &mut Builder, stone: &Stone, frame: &Frame, bays: usize) {
    let length = bays as f32 * BAY;
    let middle = length * 0.5;
    for step in 0..3 {
        let height = PLINTH / 3.0;
        let front = 0.35 + 0.3 * (2 - step) as f32;
        let place = frame.shifted(Vec3::new(middle, step as f32 * height, (front - WALK) * 0.5));
        standing_block(builder, stone.marble, &place, [length, height, front + WALK]);
    }
    let floor = frame.shifted(Vec3::Y * PLINTH);
    for bay in 0..bays {
        let centre = floor.shifted(Vec3::X * (bay as f32 + 0.5) * BAY);
        arch(builder, stone.plaster, &centre);
    }
    for axis in 0..=bays {
        column(builder, stone.marble, &floor.shifted(Vec3::X * axis as f32 * BAY));
    }
    let back = floor.shifted(Vec3::new(middle, 0.0, -WALK));
    standing_block(builder, stone.plaster, &back, [length, TOP, 2.0 * WALL]);
    let cornice = floor.shifted(Vec3::new(middle, TOP, 0.0));
    standing_block(builder, stone.marble, &cornice, [length, 0.14, 2.0 * WALL + 0.2]);
    roof(builder, stone.roof, &floor.shifted(Vec3::Y * (TOP + 0.14)), length);
}

/// A pent roof that rises from the yard to the back wall, with rows of tiles.
fn roof(builder: &mut Builder, material: u32, eave: &Frame, length: f32) {
    const ROWS: usize = 8;
    let run = (WALK + 0.6) / ROWS as f32;
    for row in 0..ROWS {
        let z = 0.45 - run * row as f32;
        let y = 0.09 * row as f32;
        let corners = [[0.0, y, z], [length, y, z], [length, y + 0.12, z - run], [0.0, y + 0.12, z - run]];
        builder.quad(material, corners.map(|c| eave.point(Vec3::from(c))));
    }
}

/// The wall of one bay over its arch: front, back and the vault between; the frame stands on the floor
/// in the middle of the bay.
fn arch(builder: &mut Builder, material: u32, frame: &Frame) {
    const SEGMENTS: usize = 16;
    // From the right springing over the crown to the left one.
    let rim: Vec<(Vec3, Vec3)> = (0..=SEGMENTS)
        .map(|segment| {
            let (sin, cos) = sin_cos(0.5 * segment as f32 / SEGMENTS as f32);
            (Vec3::new(ARCH * cos, SPRING + ARCH * sin, 0.0), Vec3::new(-cos, -sin, 0.0))
        })
        .collect();
    let (front, back) = (Vec3::Z * WALL, Vec3::NEG_Z * WALL);
    for pair in rim.windows(2) {
        let [(from, from_normal), (to, to_normal)] = [pair[0], pair[1]];
        let (from_top, to_top) = (from.with_y(TOP), to.with_y(TOP));
        builder.quad(material, [from, from_top, to_top, to].map(|p| frame.point(p + front)));
        builder.quad(material, [from, to, to_top, from_top].map(|p| frame.point(p + back)));
        let vertex = |p: Vec3, normal: Vec3| Vertex::new(frame.point(p), frame.vector(normal));
        let vault = [
            vertex(from + front, from_normal),
            vertex(to + front, to_normal),
            vertex(to + back, to_normal),
            vertex(from + back, from_normal),
        ];
        builder.triangle(material, [vault[0], vault[1], vault[2]]);
        builder.triangle(material, [vault[0], vault[2], vault[3]]);
    }
    // The strips between the arch and the bay's ends.
    let end = BAY * 0.5;
    for [left, right] in [[-end, -ARCH], [ARCH, end]] {
        let corners = [[left, SPRING], [right, SPRING], [right, TOP], [left, TOP]];
        let face = corners.map(|[x, y]| Vec3::new(x, y, 0.0));
        builder.quad(material, face.map(|p| frame.point(p + front)));
        let [a, b, c, d] = face.map(|p| frame.point(p + back));
        builder.quad(material, [b, a, d, c]);
    }
}

/// Plinth, shaft with entasis and capital, up to the springing of the arches.
fn column(builder: &mut Builder, material: u32, foot: &Frame) {
    standing_block(builder, material, foot, [0.44, 0.12, 0.44]);
    let shaft = [[0.195, 0.12], [0.165, 0.45], [0.158, 1.0], [0.15, 1.6], [0.145, 2.05], [0.19, 2.38]];
    builder.sheet(material, 1.6, 2 * 14 * 8, lathe(*foot, &shaft));
    standing_block(builder, material, &foot.shifted(Vec3::Y * 2.38), [0.46, SPRING - 2.38, 0.46]);
}

/// A pavilion that closes the corner between the arcades.
fn corner(builder: &mut Builder, stone: &Stone) {
    let tower = Frame::at(Vec3::new(-5.3, 0.0, -5.3));
    standing_block(builder, stone.plaster, &tower, [3.2, PLINTH + TOP + 0.9, 3.2]);
    standing_block(builder, stone.marble, &tower.shifted(Vec3::Y * (PLINTH + TOP + 0.9)), [3.45, 0.16, 3.45]);
    let apex = tower.point(Vec3::Y * (PLINTH + TOP + 2.2));
    let eave = [[-1.85, 1.85], [1.85, 1.85], [1.85, -1.85], [-1.85, -1.85]]
        .map(|[x, z]| tower.point(Vec3::new(x, PLINTH + TOP + 1.06, z)));
    for side in 0..4 {
        builder.flat_triangle(stone.roof, [eave[side], eave[(side + 1) % 4], apex]);
    }
}

fn fountain(builder: &mut Builder, stone: &Stone, foot: Vec3) {
    let bronze = builder.material("bronze", metal([0.72, 0.45, 0.22], 0.15));
    let water = builder.material("water", metal([0.42, 0.52, 0.55], 0.0));
    let clear = builder.material("glass", glass());
    let frame = Frame::at(foot);
    // Outside of the basin up to its lip and down again inside.
    let basin =
        [[1.5, 0.0], [1.52, 0.12], [1.36, 0.2], [1.38, 0.44], [1.5, 0.5], [1.46, 0.56], [1.3, 0.52], [1.26, 0.2]];
    builder.sheet(stone.marble, 2.6, 2 * 44 * 14, lathe(frame, &basin));
    disc(builder, water, foot + Vec3::Y * 0.46, 1.32);
    let stem = [[0.34, 0.2], [0.3, 0.5], [0.14, 0.62], [0.11, 0.95], [0.2, 1.15]];
    builder.sheet(stone.marble, 1.6, 2 * 16 * 10, lathe(frame, &stem));
    let bowl =
        [[0.16, 1.12], [0.4, 1.17], [0.62, 1.3], [0.7, 1.42], [0.68, 1.45], [0.55, 1.34], [0.3, 1.24], [0.02, 1.2]];
    builder.sheet(bronze, 2.6, 2 * 36 * 12, lathe(frame, &bowl));
    sphere(builder, clear, foot + Vec3::Y * (1.2 + 0.34), 0.34, 11);
}

/// A horizontal disc that faces up.
fn disc(builder: &mut Builder, material: u32, centre: Vec3, radius: f32) {
    const SECTORS: usize = 48;
    let rim = |sector: usize| {
        let (sin, cos) = sin_cos((sector % SECTORS) as f32 / SECTORS as f32);
        centre + Vec3::new(cos, 0.0, -sin) * radius
    };
    for sector in 0..SECTORS {
        builder.flat_triangle(material, [rim(sector), rim(sector + 1), centre]);
    }
}

/// A slender tree in a terracotta tub.
fn cypress(builder: &mut Builder, [green, tub]: [u32; 2], foot: Vec3) {
    let frame = Frame::at(foot);
    let pot = [[0.3, 0.0], [0.36, 0.3], [0.42, 0.52], [0.38, 0.54], [0.34, 0.46], [0.02, 0.46]];
    builder.sheet(tub, 2.0, 2 * 16 * 8, lathe(frame, &pot));
    let crown = [[0.03, 0.45], [0.06, 0.7], [0.4, 1.0], [0.48, 1.5], [0.36, 2.5], [0.16, 3.4], [0.01, 3.9]];
    builder.sheet(green, 1.2, 2 * 14 * 11, lathe(frame, &crown));
}
