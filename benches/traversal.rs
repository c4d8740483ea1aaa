//! Speeds side by side, as ratios in one run: strategy `direct` on the Vulkan device, the CPU twin, and the
//! traversal of the library that builds the BVH. By CPU seconds of the process, so that a software driver's
//! threads count and other programs do not; a GPU is judged by `caribou bench` instead.
//!
//! `cargo bench --bench traversal -- SCENE.glb [--camera NAME]`, by default on the procedural blob.

use std::time::Duration;

use caribou::bvh::{Bvh, Quality};
use caribou::layout::{Hit, Ray};
use caribou::render::rays::{RayKind, twin_rays};
use caribou::render::settings::Settings;
use caribou::scene::tables::Tables;
use caribou::scene::{self, Scene};
use caribou::trace::{Geometry, Query, Stream, Tracer, TracerOptions};
use caribou::twin;
use caribou::vulkan::{Gpu, GpuOptions, Place};
use cpu_time::ProcessTime;
use obvhs::BvhBuildParams;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use rayon::prelude::*;

/// Rounds; each times all three, so that a change of the machine's speed meets all alike.
const ROUNDS: usize = 7;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let scene = match arguments.first() {
        Some(path) => scene::load(path.as_ref()).unwrap_or_else(|error| panic!("{error}")),
        None => scene::procedural::build("blob", 500_000, 1).unwrap_or_else(|error| panic!("{error}")),
    };
    let bvh = Bvh::build(&scene.positions, Quality::default()).unwrap_or_else(|error| panic!("{error}"));
    let gpu = Gpu::open(&GpuOptions::default()).map_err(|error| eprintln!("SKIPPED Vulkan: {error}")).ok();
    println!("{}: {} triangles", scene.name, scene.positions.len());
    println!(
        "{:<9} {:>10} {:>12} {:>12} {:>12}   Mrays per CPU-second, medians of {ROUNDS}",
        "rays", "count", "direct", "twin", "obvhs"
    );
    for kind in [RayKind::Primary, RayKind::Diffuse] {
        compare(kind, &scene, &bvh, gpu.as_ref());
    }
}

fn compare(kind: RayKind, scene: &Scene, bvh: &Bvh, gpu: Option<&Gpu>) {
    let rays = rays(kind, scene, bvh);
    let mut library = library(scene, &rays);
    let mut direct = gpu.map(|gpu| direct(gpu, bvh, &rays));
    let mut seconds: [Vec<f64>; 3] = Default::default();
    for round in 0..=ROUNDS {
        let times = [
            direct.as_mut().map_or(f64::NAN, cpu_seconds),
            cpu_seconds(|| drop(twin::trace::trace_closest(bvh, &rays))),
            cpu_seconds(&mut library),
        ];
        // The first round warms up.
        if round > 0 {
            seconds.iter_mut().zip(times).for_each(|(all, time)| all.push(time));
        }
    }
    let rate = |k: usize| rays.len() as f64 * 1e-6 / median(seconds[k].clone());
    let ratio = |a: usize, b: usize| median(seconds[a].iter().zip(&seconds[b]).map(|(a, b)| b / a).collect());
    println!("{:<9} {:>10} {:>12.3} {:>12.3} {:>12.3}", kind.name(), rays.len(), rate(0), rate(1), rate(2));
    println!("          direct / twin {:.3}, twin / obvhs {:.3}", ratio(0, 1), ratio(1, 2));
}

fn rays(kind: RayKind, scene: &Scene, bvh: &Bvh) -> Vec<Ray> {
    let settings = Settings { ao_radius: Settings::default_ao_radius(bvh.bounds), ..Settings::default() };
    let camera = scene::select_camera(scene, None).unwrap_or_else(|error| panic!("{error}"));
    twin_rays(bvh, &Tables::new(scene), &settings.frame(&camera), kind)
}

/// Traces all rays on the device.
fn direct<'a>(gpu: &'a Gpu, bvh: &Bvh, rays: &[Ray]) -> impl FnMut() + use<'a> {
    let run = || -> caribou::Result<_> {
        let tracer = Tracer::new(gpu, Geometry::upload(gpu, bvh)?, TracerOptions::default())?;
        let hits = gpu.buffer("hits", (rays.len() * size_of::<Hit>()) as u64, Place::Device)?;
        Ok((tracer, gpu.upload("rays", rays)?, hits))
    };
    let (tracer, buffer, hits) = run().unwrap_or_else(|error| panic!("{error}"));
    let count = rays.len() as u32;
    move || {
        let mut stream = Stream::new(gpu);
        let traced = tracer.trace(&mut stream, "trace", Query::Closest, (&buffer, &hits, None), count);
        traced.and_then(|()| stream.finish()).unwrap_or_else(|error| panic!("{error}"));
    }
}

/// Traces all rays by obvhs's own two-child traversal and triangle test, on its own tree.
fn library(scene: &Scene, rays: &[Ray]) -> impl FnMut() {
    let triangles: Vec<obvhs::triangle::Triangle> = scene
        .positions
        .iter()
        .map(|&[a, b, c]| obvhs::triangle::Triangle { v0: a.into(), v1: b.into(), v2: c.into() })
        .collect();
    let parameters = BvhBuildParams { pre_split: false, ..BvhBuildParams::medium_build() };
    let tree = build_bvh2_from_tris(&triangles, parameters, &mut Duration::default());
    let ordered: Vec<_> = tree.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
    let rays: Vec<obvhs::ray::Ray> =
        rays.iter().map(|r| obvhs::ray::Ray::new(r.origin.into(), r.direction.into(), r.t_min, r.t_max)).collect();
    move || {
        let hits: Vec<f32> = rays
            .par_chunks(1024)
            .flat_map_iter(|rays| {
                rays.iter().map(|ray| {
                    let mut hit = obvhs::ray::RayHit::none();
                    tree.ray_traverse(*ray, &mut hit, |ray, id| ordered[id].intersect(ray));
                    hit.t
                })
            })
            .collect();
        std::hint::black_box(hits);
    }
}

fn cpu_seconds(mut work: impl FnMut()) -> f64 {
    let start = ProcessTime::now();
    work();
    start.elapsed().as_secs_f64()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
