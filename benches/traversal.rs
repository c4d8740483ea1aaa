//! Speeds side by side, as ratios in one run: the strategies on the Vulkan device, the CPU twin, and the
//! traversal of the library that builds the BVH. By CPU seconds of the process, so that a software driver's
//! threads count and other programs do not; a GPU is judged by `caribou bench` instead.
//!
//! `cargo bench --bench traversal -- [SCENE.glb] [--kernels FOLDER]...`, by default on the procedural blob. Kernels
//! in a folder (`NAME.spv`) compete as contestants of their own beside the built-in ones, so that a change of a
//! kernel is judged in the same run.

use std::path::{Path, PathBuf};
use std::time::Duration;

use caribou::bvh::{Bvh, Policy, Quality};
use caribou::layout::{Hit, Ray};
use caribou::render::rays::{RayKind, twin_rays};
use caribou::render::settings::Settings;
use caribou::scene::tables::Tables;
use caribou::scene::{self, Scene};
use caribou::trace::{MachineOptions, Query, RayBuffers, Strategy, Stream, Tracer, TracerOptions};
use caribou::twin;
use caribou::vulkan::{Gpu, GpuOptions, Place};
use cpu_time::ProcessTime;
use obvhs::BvhBuildParams;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use rayon::prelude::*;

/// Rounds; each times all, so that a change of the machine's speed meets all alike.
const ROUNDS: usize = 7;

fn main() {
    let (scene, folders) = arguments();
    let scene = match scene {
        Some(path) => scene::load(&path).unwrap_or_else(|error| panic!("{error}")),
        None => scene::procedural::build("blob", 500_000, 1).unwrap_or_else(|error| panic!("{error}")),
    };
    let bvh = Bvh::build(&scene.positions, Quality::default()).unwrap_or_else(|error| panic!("{error}"));
    let mut devices = vec![device(None)];
    devices.extend(folders.iter().map(|folder| device(Some(folder))));
    let devices: Vec<(String, Gpu)> = devices.into_iter().flatten().collect();
    println!("{}: {} triangles", scene.name, scene.positions.len());
    println!("medians of {ROUNDS} rounds");
    for kind in [RayKind::Primary, RayKind::Diffuse] {
        compare(kind, &scene, &bvh, &devices);
    }
}

/// The scene and the folders of kernels.
fn arguments() -> (Option<PathBuf>, Vec<PathBuf>) {
    let (mut scene, mut folders) = (None, Vec::new());
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--kernels" => folders.push(arguments.next().expect("--kernels takes a folder").into()),
            _ => scene = Some(argument.into()),
        }
    }
    (scene, folders)
}

/// The default device, with the built-in kernels or those of a folder, and what sets its contestants' names apart.
fn device(kernels: Option<&Path>) -> Option<(String, Gpu)> {
    let options = GpuOptions { kernels: kernels.map(Path::to_path_buf), ..GpuOptions::default() };
    let gpu = Gpu::open(&options).map_err(|error| eprintln!("SKIPPED Vulkan: {error}")).ok()?;
    Some((kernels.map_or(String::new(), |folder| format!(" of {}", folder.display())), gpu))
}

fn compare(kind: RayKind, scene: &Scene, bvh: &Bvh, devices: &[(String, Gpu)]) {
    let rays = rays(kind, scene, bvh);
    let mut contestants: Vec<(String, Box<dyn FnMut() + '_>)> = vec![
        ("twin".to_owned(), Box::new(|| drop(twin::trace::hits(bvh, &rays)))),
        ("obvhs".to_owned(), Box::new(library(scene, &rays))),
    ];
    for (origin, gpu) in devices {
        for (name, options) in strategies() {
            contestants.push((name + origin, Box::new(on_device(gpu, bvh, (kind, &rays), &options))));
        }
    }
    let mut seconds: Vec<Vec<f64>> = vec![Vec::new(); contestants.len()];
    for round in 0..=ROUNDS {
        for ((_, contestant), seconds) in contestants.iter_mut().zip(&mut seconds) {
            let time = cpu_seconds(contestant);
            // The first round warms up.
            if round > 0 {
                seconds.push(time);
            }
        }
    }
    println!("{}, {} rays", kind.name(), rays.len());
    for ((name, _), times) in contestants.iter().zip(&seconds) {
        let rate = rays.len() as f64 * 1e-6 / median(times.clone());
        let cost = |other: usize| median(times.iter().zip(&seconds[other]).map(|(a, b)| a / b).collect());
        let against: Vec<String> = contestants
            .iter()
            .enumerate()
            .filter(|(_, (other, _))| other != name && ["twin", "obvhs", "direct"].contains(&other.as_str()))
            .map(|(k, (other, _))| format!("{:.3} x {other}", cost(k)))
            .collect();
        println!("  {name:<22} {rate:>9.3} Mrays per CPU-second; cost {}", against.join(", "));
    }
}

/// The strategies that are compared, with the cuts of interest.
fn strategies() -> Vec<(String, TracerOptions)> {
    let with = |strategy, partition| TracerOptions {
        strategy,
        machine: MachineOptions { partition, ..MachineOptions::default() },
        ..TracerOptions::default()
    };
    let migrate = |kib: u64| (format!("migrate bytes:{kib}KiB"), with(Strategy::Migrate, Policy::Bytes(kib << 10)));
    vec![
        ("direct".to_owned(), with(Strategy::Direct, Policy::default())),
        ("persistent".to_owned(), with(Strategy::Persistent, Policy::default())),
        migrate(512),
        migrate(64),
    ]
}

fn rays(kind: RayKind, scene: &Scene, bvh: &Bvh) -> Vec<Ray> {
    let settings = Settings { ao_radius: Settings::default_ao_radius(bvh.bounds), ..Settings::default() };
    let camera = scene::select_camera(scene, None).unwrap_or_else(|error| panic!("{error}"));
    twin_rays(bvh, &Tables::new(scene), &settings.frame(&camera), kind)
}

/// Traces all rays on the device.
fn on_device<'a>(
    gpu: &'a Gpu,
    bvh: &Bvh,
    (kind, rays): (RayKind, &[Ray]),
    options: &TracerOptions,
) -> impl FnMut() + use<'a> {
    let run = || -> caribou::Result<_> {
        let tracer = Tracer::new(gpu, bvh, options, rays.len() as u32)?;
        let hits = gpu.buffer("hits", (rays.len() * size_of::<Hit>()) as u64, Place::Device)?;
        Ok((tracer, gpu.upload("rays", rays)?, hits))
    };
    let (tracer, buffer, hits) = run().unwrap_or_else(|error| panic!("{error}"));
    let count = rays.len() as u32;
    move || {
        let mut stream = Stream::new(gpu);
        let traced = tracer.trace(
            &mut stream,
            "trace",
            Query::Closest,
            &RayBuffers::new(&buffer, &hits).coherent(kind.coherent()),
            count,
        );
        traced.and_then(|_| stream.finish()).unwrap_or_else(|error| panic!("{error}"));
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
