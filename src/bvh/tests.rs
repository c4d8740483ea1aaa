//! What holds for the BVH of any scene.

use clap::ValueEnum;
use glam::Vec3;

use super::{Bvh, Quality};
use crate::scene::procedural;
use crate::shared::{LEAF_BIT, LEAF_COUNT_SHIFT};

type Positions = Vec<[Vec3; 3]>;

const UNIT: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

fn procedural_scenes(triangles: u64) -> Vec<(String, Positions)> {
    ["room", "forest", "blob", "needles"]
        .map(|name| (name.to_owned(), procedural::build(name, triangles as _, 1).unwrap().positions))
        .into()
}

fn grid(step: f32) -> Positions {
    (0..1000)
        .map(|i| UNIT.map(|v| (v + Vec3::new((i % 10) as f32, (i / 10 % 10) as f32, (i / 100) as f32)) * step))
        .collect()
}

#[test]
fn every_quality_builds_valid_trees() {
    for (name, positions) in procedural_scenes(5_000) {
        for &quality in Quality::value_variants() {
            let bvh = Bvh::build(&positions, quality).unwrap();
            assert_eq!(bvh.validate(&positions), Ok(()), "{name}, {quality:?}");
        }
    }
}

#[test]
fn strange_scenes_build_valid_trees() {
    let points = |count: usize| (0..count).map(|i| [Vec3::splat((i % 7) as f32); 3]).collect();
    let scenes: [(&str, Positions); 12] = [
        ("empty", vec![]),
        ("one triangle", vec![UNIT]),
        ("two", vec![UNIT, UNIT.map(|v| v + Vec3::Z)]),
        ("nine identical", vec![UNIT; 9]),
        ("100,000 identical", vec![UNIT; 100_000]),
        ("one point", points(1)),
        ("points", points(1_000)),
        ("one place", vec![[Vec3::ONE; 3]; 1_000]),
        ("huge", grid(1e17 / 11.0)),
        ("at the ceiling", vec![UNIT.map(|v| v * 1e18), UNIT.map(|v| v * -1e18)]),
        ("tiny", grid(1e-30)),
        ("flat and negative zero", grid(1.0).into_iter().map(|t| t.map(|v| v * Vec3::new(1.0, 1.0, -0.0))).collect()),
    ];
    for (name, positions) in scenes {
        for &quality in Quality::value_variants() {
            let bvh = Bvh::build(&positions, quality).unwrap_or_else(|error| panic!("{name}, {quality:?}: {error}"));
            assert_eq!(bvh.validate(&positions), Ok(()), "{name}, {quality:?}");
        }
    }
}

#[test]
fn coordinates_beyond_the_ceiling_are_an_error() {
    for far in [1.01e18, -1.01e18, f32::MAX, f32::INFINITY, f32::NEG_INFINITY, f32::NAN] {
        for corner in 0..3 {
            let mut positions = vec![UNIT; 3];
            positions[1][corner].y = far;
            let error = Bvh::build(&positions, Quality::Medium).unwrap_err().to_string();
            assert!(error.contains("triangle 1 has a coordinate beyond"), "{error}");
        }
    }
}

#[test]
fn builds_repeat_with_any_number_of_threads() {
    for (name, positions) in procedural_scenes(60_000) {
        for &quality in Quality::value_variants() {
            let build = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| Bvh::build(&positions, quality)).unwrap()
            };
            let first = build(1);
            for threads in [1, 2, 2, 5] {
                let again = build(threads);
                let same = bytemuck::cast_slice::<_, u8>(&first.nodes) == bytemuck::cast_slice::<_, u8>(&again.nodes)
                    && first.triangles == again.triangles
                    && first.slots == again.slots;
                assert!(same, "{name}, {quality:?}, {threads} threads");
            }
        }
    }
}

/// Each fault that `validate` is there for is found by it.
#[test]
fn validation_finds_planted_faults() {
    let positions = grid(1.0);
    let good = Bvh::build(&positions, Quality::Medium).unwrap();
    let deep = (0..good.nodes.len()).rev().find(|&i| good.nodes[i].child[0] & LEAF_BIT != 0).unwrap();
    type Fault = fn(&mut Bvh, usize);
    let faults: [(&str, Fault); 9] = [
        ("a box too small", |bvh, deep| bvh.nodes[deep].y[1] = bvh.nodes[deep].y[1].next_down()),
        ("children exchanged", |bvh, _| bvh.nodes[0].child.swap(0, 1)),
        ("a link out of range", |bvh, _| bvh.nodes[0].child[1] = bvh.nodes.len() as u32),
        ("a cycle", |bvh, deep| bvh.nodes[deep].child[0] = 0),
        ("a triangle left out", |bvh, deep| bvh.nodes[deep].child[0] -= 1 << LEAF_COUNT_SHIFT),
        ("a leaf dropped", |bvh, deep| bvh.nodes[deep].child[0] = LEAF_BIT),
        ("a wrong slot", |bvh, _| bvh.slots.swap(3, 700)),
        ("a wrong corner", |bvh, _| bvh.triangles[5].v2[2] += 0.25),
        ("a wrong primitive", |bvh, _| bvh.triangles[5].prim = (bvh.triangles[5].prim + 1) % 1000),
    ];
    for (name, plant) in faults {
        let mut bvh = good.clone();
        plant(&mut bvh, deep);
        assert!(bvh.validate(&positions).is_err(), "{name}");
    }
}
