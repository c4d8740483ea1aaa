//! Hits do not depend on the tree: not on its quality, and so not on the order in which nodes are visited.
#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod common;

use caribou::bvh::{Bvh, Quality};
use caribou::layout::{Hit, Ray};
use caribou::twin::trace::{trace_any, trace_closest};
use clap::ValueEnum;
use common::closed::{Closed, meshes, ray};
use glam::Vec3;

const RAYS: u32 = 100_000;

/// Hits of both queries on trees of all qualities, which must be the same; those of the nearest.
fn hits_of_all_qualities(name: &str, positions: &[[Vec3; 3]], rays: &[Ray]) -> Vec<Hit> {
    let mut first: Option<[Vec<Hit>; 2]> = None;
    let mut trees = Vec::new();
    for &quality in Quality::value_variants() {
        let bvh = Bvh::build(positions, quality).unwrap();
        let hits = [trace_closest(&bvh, rays).0, trace_any(&bvh, rays).0];
        let expected = first.get_or_insert_with(|| hits.clone());
        for (query, (expected, hits)) in expected.iter().zip(&hits).enumerate() {
            for (i, (a, b)) in expected.iter().zip(hits).enumerate() {
                let same = bytemuck::bytes_of(a) == bytemuck::bytes_of(b);
                assert!(same, "{name}, {quality:?}, query {query}: {a:?}, {b:?} for {:?}", rays[i]);
            }
        }
        trees.push(bvh.nodes);
    }
    assert!(trees.iter().any(|tree| *tree != trees[0]), "{name}: the qualities differ at all");
    let [closest, any] = first.unwrap();
    for (i, (a, b)) in closest.iter().zip(&any).enumerate() {
        assert_eq!(a.is_hit(), b.is_hit(), "{name}: {:?}", rays[i]);
    }
    closest
}

#[test]
fn hits_do_not_depend_on_the_tree() {
    for (name, scene) in common::small_scenes() {
        let (low, high) = scene.bounds().unwrap();
        let mesh = Closed {
            name: "",
            inside: ((low + high) / 2.0, (high - low).max_element() / 2.0),
            positions: scene.positions,
        };
        let rays: Vec<Ray> = (0..RAYS).map(|i| ray(&mesh, i)).collect();
        let hits = hits_of_all_qualities(&name, &mesh.positions, &rays);
        assert!(hits.iter().filter(|hit| hit.is_hit()).count() > RAYS as usize / 4, "{name}");
    }
}

#[test]
fn of_coincident_triangles_the_lowest_id_is_hit() {
    for mesh in meshes(12, Vec3::ZERO) {
        let rays: Vec<Ray> = (0..RAYS).map(|i| ray(&mesh, i)).collect();
        let once = hits_of_all_qualities(mesh.name, &mesh.positions, &rays);
        // The second copy runs backwards, and its ids are higher.
        let twice = mesh.positions.iter().copied().chain(mesh.positions.iter().rev().copied()).collect::<Vec<_>>();
        assert_eq!(hits_of_all_qualities(mesh.name, &twice, &rays), once, "{}", mesh.name);
    }
}
