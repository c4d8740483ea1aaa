//! Quantised nodes: boxes hold those of full nodes, and no ray can tell by its hit.
#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod common;

use caribou::bvh::statistics::child_bounds;
use caribou::bvh::{Bvh, Quality, QuantisedBvh};
use caribou::layout::{Hit, QuantisedNode, Ray, RayCounters};
use caribou::render::rays::{RayKind, twin_rays};
use caribou::render::settings::Settings;
use caribou::scene::tables::Tables;
use caribou::scene::{self, Scene, builtin};
use caribou::shared::{LEAF_BIT, LEAF_COUNT_MASK, LEAF_COUNT_SHIFT};
use caribou::trace::{NodeFormat, Query, Strategy, Totals, TracerOptions, TwinTracer};
use caribou::twin::quantised::decode_node;
use common::closed::{meshes, ray};
use common::{rays_around, small_scenes, trace_on};
use glam::Vec3;

/// Trees of all shapes, sizes and places.
fn trees() -> Vec<(String, Bvh)> {
    let built = |positions: &[[Vec3; 3]]| Bvh::build(positions, Quality::default()).unwrap();
    let mut trees: Vec<_> = small_scenes().into_iter().map(|(name, scene)| (name, common::bvh(&scene))).collect();
    for offset in [Vec3::ZERO, Vec3::new(148376.0, 1234.0, -223423.0), Vec3::splat(1e7)] {
        for exponent in [-52, -20, 0, 30] {
            let scale = 2f32.powi(exponent);
            trees.extend(meshes(8, offset).into_iter().map(|mesh| {
                let scaled: Vec<_> = mesh.positions.iter().map(|t| t.map(|v| scene::floored(v * scale))).collect();
                (format!("{} at {offset}, 2^{exponent}", mesh.name), built(&scaled))
            }));
        }
    }
    trees.push(("nothing".to_owned(), built(&[])));
    trees.push(("one triangle".to_owned(), built(&[[Vec3::ZERO, Vec3::X, Vec3::Y]])));
    trees.push(("a point".to_owned(), built(&[[Vec3::splat(3.0); 3]])));
    trees.push(("the largest".to_owned(), built(&[[Vec3::splat(-1e18), Vec3::splat(1e18), Vec3::X * 1e18]; 20])));
    trees
}

#[test]
fn quantised_boxes_hold_the_exact_ones_and_links_are_the_same() {
    assert_eq!(size_of::<QuantisedNode>(), 32);
    for (name, bvh) in trees() {
        for (i, quantised) in (0..).zip(&QuantisedBvh::new(&bvh).nodes) {
            let (full, decoded) = (&bvh.nodes[i as usize], decode_node(i, quantised));
            for side in 0..2 {
                let (low, high) = child_bounds(full, side);
                let (outer_low, outer_high) = child_bounds(&decoded, side);
                let empty = full.child[side] == LEAF_BIT;
                if empty {
                    let (count, leaf) =
                        (decoded.child[side] >> LEAF_COUNT_SHIFT & LEAF_COUNT_MASK, decoded.child[side]);
                    assert!(leaf & LEAF_BIT != 0 && count == 0, "{name}: node {i}");
                } else {
                    assert_eq!(decoded.child[side], full.child[side], "{name}: node {i}");
                    let holds = outer_low.cmple(low).all() && outer_high.cmpge(high).all();
                    assert!(holds, "{name}: node {i}, child {side}: {outer_low} {low} {high} {outer_high}");
                }
            }
        }
    }
}

/// No device can round a decoded plane another way, because there is nothing to round.
#[test]
fn quantised_planes_decode_exactly() {
    for (name, bvh) in trees() {
        for (i, node) in (0..).zip(&QuantisedBvh::new(&bvh).nodes) {
            let decoded = decode_node(i, node);
            for (axis, (bytes, planes)) in
                [(node.x, decoded.x), (node.y, decoded.y), (node.z, decoded.z)].iter().enumerate()
            {
                let exponent = (node.exponents >> (8 * axis) & 255) as i32;
                assert!((1..255).contains(&exponent), "{name}: node {i}: the step is a normal number");
                for (count, plane) in bytes.to_le_bytes().into_iter().zip(planes) {
                    let exact = f64::from(node.origin[axis]) + f64::from(count) * 2f64.powi(exponent - 127);
                    assert_eq!(f64::from(*plane), exact, "{name}: node {i}, axis {axis}");
                }
            }
        }
    }
}

fn twin(bvh: &Bvh, rays: &[Ray], query: Query, nodes: NodeFormat) -> (Vec<Hit>, Vec<RayCounters>) {
    let options = TracerOptions { nodes, ..TracerOptions::default() };
    let traced = TwinTracer::new(bvh, &options).unwrap().trace(query, rays).unwrap();
    (traced.hits, traced.counters)
}

/// Hits of both formats, bit for bit; returns by what factor visits grew.
fn same_hits(what: &str, bvh: &Bvh, rays: &[Ray], query: Query) -> f64 {
    let [full, quantised] = [NodeFormat::Full, NodeFormat::Quantised].map(|nodes| twin(bvh, rays, query, nodes));
    for (i, (a, b)) in full.0.iter().zip(&quantised.0).enumerate() {
        assert_eq!(bytemuck::bytes_of(a), bytemuck::bytes_of(b), "{what}: {:?}", rays[i]);
    }
    let visits = |counters: &[RayCounters]| Totals::of(counters).node_visits as f64;
    visits(&quantised.1) / visits(&full.1).max(1.0)
}

#[test]
fn quantised_hits_are_those_of_full_nodes_for_all_scenes_and_kinds_of_rays() {
    let named = |name: &str| scene::load_slice(name, builtin::builtin(name).unwrap()).unwrap();
    let builtin = ["cornell", "courtyard", "gallery"].map(|name| (name.to_owned(), named(name)));
    for (name, scene) in builtin.into_iter().chain(small_scenes()) {
        let bvh = common::bvh(&scene);
        let settings = Settings {
            width: 96,
            height: 64,
            ao_radius: Settings::default_ao_radius(bvh.bounds),
            ..Settings::default()
        };
        let frame = settings.frame(&scene::select_camera(&scene, None).unwrap());
        for kind in RayKind::ALL {
            let rays = twin_rays(&bvh, &Tables::new(&scene), &frame, kind);
            let growth = same_hits(&name, &bvh, &rays, kind.query());
            println!("{name}, {}: {growth:.3} times the node visits", kind.name());
            // A grid of 255 steps makes boxes of a node at most 1 % wider each way.
            assert!((0.99..1.25).contains(&growth), "{name}, {kind:?}: {growth}");
        }
        same_hits(&name, &bvh, &rays_around(&scene, 5_000), Query::Closest);
    }
}

#[test]
fn quantised_hits_are_those_of_full_nodes_far_from_the_origin() {
    for offset in [Vec3::ZERO, Vec3::new(148376.0, 1234.0, -223423.0)] {
        for mesh in meshes(24, offset) {
            let bvh = Bvh::build(&mesh.positions, Quality::Medium).unwrap();
            let rays: Vec<Ray> = (0..20_000).map(|i| ray(&mesh, i)).collect();
            same_hits(mesh.name, &bvh, &rays, Query::Closest);
            same_hits(mesh.name, &bvh, &rays, Query::Any);
        }
    }
}

#[test]
fn quantised_gpu_hits_and_counters_equal_the_twins_with_any_step_limit() {
    let Some(gpu) = common::gpu() else { return };
    let mut cases: Vec<(String, Bvh, Vec<Ray>)> = small_scenes()
        .into_iter()
        .map(|(name, scene): (String, Scene)| (name, common::bvh(&scene), rays_around(&scene, 4_000)))
        .collect();
    for mesh in meshes(8, Vec3::new(148376.0, 1234.0, -223423.0)) {
        let bvh = Bvh::build(&mesh.positions, Quality::Medium).unwrap();
        cases.push((mesh.name.to_owned(), bvh, (0..4_000).map(|i| ray(&mesh, i)).collect()));
    }
    let rays = cases[0].2.clone();
    cases.extend(trees().into_iter().rev().take(4).map(|(name, bvh)| (name, bvh, rays.clone())));
    for (name, bvh, rays) in cases {
        for query in [Query::Closest, Query::Any] {
            let expected = twin(&bvh, &rays, query, NodeFormat::Quantised);
            for options in [None, Some(1), Some(7), Some(100)].into_iter().flat_map(common::both_kernels) {
                let options = TracerOptions { nodes: NodeFormat::Quantised, ..options };
                let device = trace_on(&gpu, &bvh, &rays, query, options);
                for (i, ray) in rays.iter().enumerate() {
                    let (a, b) = (&device.0[i], &expected.0[i]);
                    assert_eq!(bytemuck::bytes_of(a), bytemuck::bytes_of(b), "{name}, {options:?}: {ray:?}");
                    assert_eq!(device.1[i], expected.1[i], "{name}, {options:?}: counters of {ray:?}");
                }
            }
        }
    }
}

#[test]
fn quantised_nodes_are_refused_where_a_strategy_cannot_read_them() {
    let bvh = Bvh::build(&[], Quality::default()).unwrap();
    for strategy in [Strategy::Persistent, Strategy::Migrate] {
        let options = TracerOptions { strategy, nodes: NodeFormat::Quantised, ..TracerOptions::default() };
        let error = TwinTracer::new(&bvh, &options).err().unwrap();
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains("--strategy direct"), "{error}");
    }
}
