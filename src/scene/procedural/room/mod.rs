//! An indoor room. Like in real interiors a wall is two triangles, a chair leg twelve and a vase
//! thousands: what is flat stays coarse and all further triangles go to what is curved.

mod furniture;
mod parts;

use super::mesh::{Builder, Frame};
use super::random::Random;
use crate::scene::{LightKind, Material, Scene};
use furniture::Furnisher;
use glam::Vec3;
use parts::Parts;

/// Half extents of the room in metres.
const HALF: Vec3 = Vec3::new(3.4, 1.4, 2.6);

/// Exactly `triangles` triangles. The furniture comes in order of importance; what does not fit the count
/// is left out, and what is left of the count refines the curved parts.
pub fn build(triangles: usize, seed: u64) -> Scene {
    let mut builder = Builder::new("room", triangles);
    let materials = Materials::new(&mut builder);
    let mut parts = Parts::default();
    furnish(&mut parts, &materials, seed);
    parts.build(&mut builder, triangles);

    builder.camera(Vec3::new(2.9, 1.65, 2.25), Vec3::new(-0.6, 0.85, -0.9), 58.0);
    for (name, x) in [("pendant left", -0.6), ("pendant right", 0.6)] {
        let position = Vec3::new(x, 1.72, 0.1);
        builder.light(name, [9.0, 7.5, 5.6], LightKind::Point { position, range: f32::INFINITY });
    }
    builder.finish()
}

struct Materials {
    plaster: u32,
    parquet: u32,
    oak: u32,
    walnut: u32,
    cloth: [u32; 3],
    books: [u32; 4],
    ceramic: [u32; 3],
    brass: u32,
    glass: u32,
    mirror: u32,
    bulb: u32,
    plant: u32,
}

impl Materials {
    fn new(builder: &mut Builder) -> Self {
        let metal = |base_color, roughness| Material { base_color, metallic: 1.0, roughness, ..Material::default() };
        Materials {
            plaster: builder.matte("plaster", [0.78, 0.75, 0.70]),
            parquet: builder.matte("parquet", [0.52, 0.34, 0.19]),
            oak: builder.matte("oak", [0.50, 0.33, 0.18]),
            walnut: builder.matte("walnut", [0.27, 0.15, 0.08]),
            cloth: [
                builder.matte("linen", [0.66, 0.62, 0.54]),
                builder.matte("wool", [0.14, 0.25, 0.34]),
                builder.matte("ochre cloth", [0.62, 0.38, 0.10]),
            ],
            books: [
                builder.matte("red book", [0.45, 0.07, 0.05]),
                builder.matte("blue book", [0.06, 0.12, 0.35]),
                builder.matte("green book", [0.08, 0.24, 0.12]),
                builder.matte("cream book", [0.70, 0.63, 0.48]),
            ],
            ceramic: [
                builder.matte("white ceramic", [0.80, 0.79, 0.76]),
                builder.matte("celadon", [0.36, 0.55, 0.45]),
                builder.matte("terracotta", [0.55, 0.22, 0.11]),
            ],
            brass: builder.material("brass", metal([0.88, 0.66, 0.32], 0.3)),
            glass: builder.material("glass", Material { roughness: 0.0, transmission: 1.0, ..Material::default() }),
            mirror: builder.material("mirror", metal([0.93, 0.94, 0.94], 0.0)),
            bulb: builder.material("bulb", Material { emissive: [6.0, 4.8, 3.4], ..Material::default() }),
            plant: builder.matte("plant", [0.08, 0.27, 0.07]),
        }
    }
}

/// Everything in the room, the indispensable first.
fn furnish(parts: &mut Parts, materials: &Materials, seed: u64) {
    shell(parts, materials);
    let mut room = Furnisher { parts, materials, random: Random::new(seed) };
    room.table(Frame::at(Vec3::new(0.0, 0.0, 0.1)));
    room.pendant(Vec3::new(-0.6, 1.72, 0.1), 2.0 * HALF.y);
    room.pendant(Vec3::new(0.6, 1.72, 0.1), 2.0 * HALF.y);
    for (place, turns) in [((-0.55, -0.6), 0.5), ((0.55, -0.6), 0.52), ((-0.5, 0.85), 0.02), ((0.6, 0.8), -0.03)] {
        room.chair(Frame::turned(Vec3::new(place.0, 0.0, place.1), turns));
    }
    room.vessel(Vec3::new(0.1, 0.76, 0.1), 0.16, 0.36);
    room.bookcase(Frame::at(Vec3::new(-1.9, 0.0, -2.38)));
    room.sofa(Frame::turned(Vec3::new(-2.75, 0.0, 0.7), 0.25));
    room.rug(Vec3::new(0.0, 0.004, 0.1), 1.9, 1.35);
    room.curtains(Vec3::new(0.9, 0.1, -HALF.z + 0.14), 1.35);
    room.mirror(Vec3::new(-HALF.x + 0.02, 1.65, -1.3));
    room.plant(Vec3::new(2.7, 0.0, -2.0), 60);
    room.set_table(Vec3::new(0.0, 0.76, 0.1));
    room.bookcase(Frame::at(Vec3::new(-0.75, 0.0, -2.38)));
    room.floor_lamp(Vec3::new(-2.8, 0.0, 2.05));
    room.plant(Vec3::new(-2.95, 0.0, -1.95), 90);
}

/// Walls, floor and ceiling about a window in the back wall, all facing inwards.
fn shell(parts: &mut Parts, materials: &Materials) {
    let Vec3 { x, y, z } = HALF;
    let top = 2.0 * y;
    let mut wall = |corners: [[f32; 3]; 4], material| parts.quad(material, corners.map(Vec3::from));
    wall([[-x, 0.0, z], [x, 0.0, z], [x, 0.0, -z], [-x, 0.0, -z]], materials.parquet);
    wall([[-x, top, -z], [x, top, -z], [x, top, z], [-x, top, z]], materials.plaster);
    wall([[-x, 0.0, z], [-x, 0.0, -z], [-x, top, -z], [-x, top, z]], materials.plaster);
    wall([[x, 0.0, -z], [x, 0.0, z], [x, top, z], [x, top, -z]], materials.plaster);
    wall([[x, 0.0, z], [-x, 0.0, z], [-x, top, z], [x, top, z]], materials.plaster);
    // The back wall: beside, below and above an opening to the sky.
    let (left, right, sill, lintel) = (-0.1, 1.9, 0.8, 2.3);
    wall([[-x, 0.0, -z], [left, 0.0, -z], [left, top, -z], [-x, top, -z]], materials.plaster);
    wall([[right, 0.0, -z], [x, 0.0, -z], [x, top, -z], [right, top, -z]], materials.plaster);
    wall([[left, 0.0, -z], [right, 0.0, -z], [right, sill, -z], [left, sill, -z]], materials.plaster);
    wall([[left, lintel, -z], [right, lintel, -z], [right, top, -z], [left, top, -z]], materials.plaster);
}
