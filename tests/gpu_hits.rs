//! Hits on the device equal the twin's, bit for bit.
#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod common;

use caribou::layout::{Hit, Ray, RayCounters};
use caribou::trace::Query;
use caribou::twin;

use common::{both_kernels, rays_around, trace_on};

fn assert_equal(what: &str, device: &(Vec<Hit>, Vec<RayCounters>), twin: &(Vec<Hit>, Vec<RayCounters>), rays: &[Ray]) {
    assert!(twin.0.iter().any(Hit::is_hit) && !twin.0.iter().all(Hit::is_hit), "{what}: hits and misses");
    common::assert_same(what, device, twin, rays);
}

#[test]
fn gpu_hits_and_counters_equal_the_twins() {
    let Some(gpu) = common::gpu() else { return };
    for (name, scene) in common::small_scenes() {
        let (bvh, rays) = (common::bvh(&scene), rays_around(&scene, 20_000));
        let closest = twin::trace::trace_closest(&bvh, &rays);
        let any = twin::trace::trace_any(&bvh, &rays);
        for options in both_kernels(None) {
            assert_equal(&name, &trace_on(&gpu, &bvh, &rays, Query::Closest, options), &closest, &rays);
            assert_equal(&name, &trace_on(&gpu, &bvh, &rays, Query::Any, options), &any, &rays);
        }
    }
}

#[test]
fn gpu_hits_are_the_same_with_any_step_limit() {
    let Some(gpu) = common::gpu() else { return };
    let scene = caribou::scene::procedural::build("needles", 4_000, 1).unwrap();
    let (bvh, rays) = (common::bvh(&scene), rays_around(&scene, 2_000));
    let closest = twin::trace::trace_closest(&bvh, &rays);
    let any = twin::trace::trace_any(&bvh, &rays);
    for options in [1, 7, 100].into_iter().flat_map(|limit| both_kernels(Some(limit))) {
        assert_equal("closest", &trace_on(&gpu, &bvh, &rays, Query::Closest, options), &closest, &rays);
        assert_equal("any", &trace_on(&gpu, &bvh, &rays, Query::Any, options), &any, &rays);
    }
}
