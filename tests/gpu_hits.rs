//! Hits on the device equal the twin's, bit for bit.
#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod common;

use caribou::layout::{Hit, Ray, RayCounters};
use caribou::scene::Scene;
use caribou::trace::Query;
use caribou::twin;
use glam::Vec3;

use common::{both_kernels, trace_on};

/// Rays from around the scene towards it, axis-parallel ones among them.
fn rays(scene: &Scene, count: u32) -> Vec<Ray> {
    let (low, high) = scene.bounds().unwrap();
    let (middle, size) = ((low + high) * 0.5, (high - low).length());
    let direction = |i| twin::sampling::sphere_direction(twin::random::random2(7, 0, 0, i));
    (0..count)
        .map(|i| {
            let origin = middle + direction(i) * size * 0.6;
            let target = middle + direction(i + count) * size * 0.3;
            let mut d = (target - origin).normalize();
            if i % 16 == 0 {
                d = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z][(i / 16 % 6) as usize];
            }
            Ray { origin: (origin - d * size).into(), t_min: 0.0, direction: d.into(), t_max: 3.0 * size }
        })
        .collect()
}

fn assert_equal(what: &str, device: &(Vec<Hit>, Vec<RayCounters>), twin: &(Vec<Hit>, Vec<RayCounters>)) {
    assert!(twin.0.iter().any(Hit::is_hit) && !twin.0.iter().all(Hit::is_hit), "{what}: hits and misses");
    for i in 0..twin.0.len() {
        assert_eq!(bytemuck::bytes_of(&device.0[i]), bytemuck::bytes_of(&twin.0[i]), "{what}: hit of ray {i}");
        assert_eq!(device.1[i], twin.1[i], "{what}: counters of ray {i}");
    }
}

#[test]
fn gpu_hits_and_counters_equal_the_twins() {
    let Some(gpu) = common::gpu() else { return };
    for (name, scene) in common::small_scenes() {
        let (bvh, rays) = (common::bvh(&scene), rays(&scene, 20_000));
        let closest = twin::trace::trace_closest(&bvh, &rays);
        let any = twin::trace::trace_any(&bvh, &rays);
        for options in both_kernels(None) {
            assert_equal(&name, &trace_on(&gpu, &bvh, &rays, Query::Closest, options), &closest);
            assert_equal(&name, &trace_on(&gpu, &bvh, &rays, Query::Any, options), &any);
        }
    }
}

#[test]
fn gpu_hits_are_the_same_with_any_step_limit() {
    let Some(gpu) = common::gpu() else { return };
    let scene = caribou::scene::procedural::build("needles", 4_000, 1).unwrap();
    let (bvh, rays) = (common::bvh(&scene), rays(&scene, 2_000));
    let closest = twin::trace::trace_closest(&bvh, &rays);
    let any = twin::trace::trace_any(&bvh, &rays);
    for options in [1, 7, 100].into_iter().flat_map(|limit| both_kernels(Some(limit))) {
        assert_equal("closest", &trace_on(&gpu, &bvh, &rays, Query::Closest, options), &closest);
        assert_equal("any", &trace_on(&gpu, &bvh, &rays, Query::Any, options), &any);
    }
}
