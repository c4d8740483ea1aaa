//! Hits do not depend on the unit of length, and nothing on how a device treats denormal numbers.
#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod common;

use caribou::bvh::{Bvh, Quality};
use caribou::layout::{Hit, Ray};
use caribou::scene::floored;
use caribou::trace::Query;
use caribou::twin::trace::trace_closest;
use common::closed::{Closed, meshes, ray};
use glam::Vec3;

fn scaled(positions: &[[Vec3; 3]], scale: f32) -> Bvh {
    let positions: Vec<_> = positions.iter().map(|corners| corners.map(|v| floored(v * scale))).collect();
    Bvh::build(&positions, Quality::Medium).unwrap()
}

fn scaled_rays(rays: &[Ray], scale: f32) -> Vec<Ray> {
    rays.iter().map(|ray| Ray { origin: floored(Vec3::from(ray.origin) * scale).into(), ..*ray }).collect()
}

fn rays(mesh: &Closed) -> Vec<Ray> {
    // Unit directions, as those of all generators: the others would be scaled too.
    (0..20_000).filter(|i| (i / 8u32).is_multiple_of(2)).map(|i| ray(mesh, i)).collect()
}

#[test]
fn hits_do_not_depend_on_the_unit_of_length() {
    for mesh in meshes(8, Vec3::ZERO) {
        let rays = rays(&mesh);
        let expected = trace_closest(&scaled(&mesh.positions, 1.0), &rays).0;
        for exponent in [10, 20, 40, 55] {
            let scale = 2f32.powi(exponent);
            let hits = trace_closest(&scaled(&mesh.positions, scale), &scaled_rays(&rays, scale)).0;
            let scaled = expected.iter().map(|hit| Hit { t: hit.t * scale, ..*hit });
            for ((a, b), ray) in scaled.zip(&hits).zip(&rays) {
                assert_eq!(bytemuck::bytes_of(&a), bytemuck::bytes_of(b), "{}, 2^{exponent}: {ray:?}", mesh.name);
            }
        }
    }
}

/// Near `SHEAR_FLOOR` a ray that grazes a corner may meet another triangle than at full size, but none leaks.
#[test]
fn small_closed_meshes_are_watertight() {
    for mesh in meshes(8, Vec3::ZERO) {
        let rays = rays(&mesh);
        for exponent in [-10, -20] {
            let scale = 2f32.powi(exponent);
            let hits = trace_closest(&scaled(&mesh.positions, scale), &scaled_rays(&rays, scale)).0;
            let leak = hits.iter().position(|hit| !hit.is_hit());
            assert_eq!(leak.map(|i| rays[i]), None, "{}, 2^{exponent}", mesh.name);
        }
    }
}

#[test]
fn gpu_hits_equal_the_twins_at_any_scale() {
    let Some(gpu) = common::gpu() else { return };
    for mesh in meshes(8, Vec3::ZERO) {
        let rays = rays(&mesh);
        for exponent in [-126, -100, -90, -60, -52, -48, -44, -40, -36, -20, 20, 40, 55] {
            let scale = 2f32.powi(exponent);
            let (bvh, rays) = (scaled(&mesh.positions, scale), scaled_rays(&rays, scale));
            let twin = trace_closest(&bvh, &rays);
            for options in common::both_kernels(None) {
                let device = common::trace_on(&gpu, &bvh, &rays, Query::Closest, options);
                common::assert_same(&format!("{}, 2^{exponent}", mesh.name), &device, &twin, &rays);
            }
        }
    }
}
