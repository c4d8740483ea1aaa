//! No ray leaves a closed mesh, wherever the mesh is and whatever the ray is aimed at.
//!
//! `CARIBOU_WATERTIGHT_RAYS` sets the number of rays, by default ten million each on device and twin.
#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod common;

use caribou::bvh::{Bvh, Quality};
use caribou::layout::{Hit, Ray};
use caribou::stability::naive::moller_trumbore;
use caribou::trace::{Query, TracerOptions};
use caribou::twin;
use common::closed::{Closed, close_ray, meshes, ray};
use glam::Vec3;
use rayon::prelude::*;

/// Where Embree's own test of watertightness puts its meshes, and the origin.
const OFFSETS: [Vec3; 2] = [Vec3::ZERO, Vec3::new(148376.0, 1234.0, -223423.0)];

/// Rays of a batch.
const BATCH: u32 = 1 << 18;

#[test]
fn twin_leaks_no_ray() {
    leak_no_ray(&scenes(24), ray, |bvh, rays| twin::trace::trace_closest(bvh, rays).0);
}

#[test]
fn twin_leaks_no_ray_that_starts_close_to_an_edge() {
    leak_no_ray(&large_cube(), close_ray, |bvh, rays| twin::trace::trace_closest(bvh, rays).0);
}

#[test]
fn gpu_leaks_no_ray() {
    let Some(gpu) = common::gpu() else { return };
    let trace = |bvh: &Bvh, rays: &[Ray]| common::trace_on(&gpu, bvh, rays, Query::Closest, TracerOptions::default()).0;
    leak_no_ray(&scenes(24), ray, trace);
}

#[test]
fn gpu_hits_inside_closed_meshes_equal_the_twins() {
    let Some(gpu) = common::gpu() else { return };
    for (mesh, bvh) in scenes(24) {
        let rays: Vec<Ray> = (0..50_000).map(|i| ray(&mesh, i)).collect();
        let twin = twin::trace::trace_closest(&bvh, &rays);
        for options in common::both_kernels(None) {
            let device = common::trace_on(&gpu, &bvh, &rays, Query::Closest, options);
            common::assert_same(mesh.name, &device, &twin, &rays);
        }
    }
}

/// Shows that the rays are hard and that this test can fail.
#[test]
fn the_test_of_moller_and_trumbore_leaks_on_such_rays() {
    for offset in OFFSETS {
        for mesh in meshes(8, offset) {
            let leaks = (0..100_000u32)
                .into_par_iter()
                .map(|i| ray(&mesh, i))
                .filter(|ray| !mesh.positions.iter().any(|&triangle| moller_trumbore(ray, triangle)));
            let leaks = leaks.count();
            println!("{} at {offset}: {leaks} of 100,000 rays leak", mesh.name);
            assert!(leaks > 0, "{} at {offset}", mesh.name);
        }
    }
}

fn scenes(n: i32) -> Vec<(Closed, Bvh)> {
    let with_bvh = |mesh: Closed| {
        let bvh = Bvh::build(&mesh.positions, Quality::Medium).unwrap();
        (mesh, bvh)
    };
    OFFSETS.into_iter().flat_map(|offset| meshes(n, offset)).map(with_bvh).collect()
}

/// A cube around the origin with two triangles a side.
fn large_cube() -> Vec<(Closed, Bvh)> {
    scenes(1).into_iter().find(|(mesh, _)| mesh.name == "cube").into_iter().collect()
}

fn leak_no_ray(scenes: &[(Closed, Bvh)], ray: fn(&Closed, u32) -> Ray, trace: impl Fn(&Bvh, &[Ray]) -> Vec<Hit>) {
    let rays = std::env::var("CARIBOU_WATERTIGHT_RAYS").map_or(10_000_000, |n| n.parse().unwrap());
    let mut traced = 0;
    for first in (0..).step_by(BATCH as usize) {
        for (mesh, bvh) in scenes {
            let rays: Vec<Ray> = (first..first + BATCH).into_par_iter().map(|i| ray(mesh, i)).collect();
            let hits = trace(bvh, &rays);
            let leak = hits.iter().position(|hit| !hit.is_hit());
            assert_eq!(leak.map(|i| rays[i]), None, "{}: a ray leaks", mesh.name);
            traced += u64::from(BATCH);
        }
        if traced >= rays {
            return;
        }
    }
}
