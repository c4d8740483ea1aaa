//! Regular grids, where all neighbours are equally near: a builder that is weak on ties makes poor trees of them.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use caribou::bvh::statistics::Statistics;
use caribou::bvh::{Bvh, Quality};
use clap::ValueEnum;
use common::closed::meshes;
use glam::Vec3;

/// A cube of as many triangles as a sphere costs about as much, near the origin and far from it. With ties, it costs
/// six times as much (quality medium).
#[test]
fn trees_of_regular_grids_are_as_good_as_those_of_a_sphere() {
    for offset in [Vec3::ZERO, Vec3::new(148376.0, 1234.0, -223423.0)] {
        for &quality in Quality::value_variants() {
            let costs: Vec<f64> = meshes(24, offset)
                .iter()
                .filter(|mesh| ["sphere", "cube"].contains(&mesh.name))
                .map(|mesh| Statistics::of(&Bvh::build(&mesh.positions, quality).unwrap()).sah_cost)
                .collect();
            println!("{quality:?} at {offset}: {costs:.1?}");
            assert!(costs[1] < 1.3 * costs[0], "{quality:?} at {offset}: sphere and cube {costs:.1?}");
        }
    }
}
