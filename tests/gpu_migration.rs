//! Strategies agree: hits, counters and rounds on the device are the twin's, and hits are those of `direct`.
#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod common;

use caribou::bvh::{Bvh, Owners};
use caribou::layout::{Hit, Ray, RayCounters};
use caribou::render::rays::{RayKind, twin_rays};
use caribou::render::settings::Settings;
use caribou::scene::tables::Tables;
use caribou::scene::{self, Scene};
use caribou::trace::digest::hits_digest;
use caribou::trace::step_sample::sample;
use caribou::trace::{
    MachineOptions, MigrationReport, Query, RayBuffers, StepSample, Strategy, Stream, Tracer, TracerOptions, TwinTracer,
};
use caribou::vulkan::{Gpu, Place};

use common::trace_and_report;

const POLICIES: [&str; 15] = [
    "level:0",
    "level:2",
    "level:5",
    "level:9",
    "level:14",
    "bytes:512",
    "bytes:4KiB",
    "bytes:16KiB",
    "bytes:64KiB",
    "bytes:1MiB",
    "sah:512",
    "sah:4KiB",
    "sah:16KiB",
    "sah:64KiB",
    "sah:1MiB",
];

type Outcome = (Vec<Hit>, Vec<RayCounters>, Option<MigrationReport>);

fn migrate(policy: &str, sms: u32) -> TracerOptions {
    let machine = MachineOptions { partition: policy.parse().unwrap(), sms, warps_per_sm: 2, ..Default::default() };
    TracerOptions { strategy: Strategy::Migrate, machine, ..TracerOptions::default() }
}

fn rays(scene: &Scene, bvh: &Bvh, kind: RayKind, (width, height): (u32, u32)) -> Vec<Ray> {
    let ao_radius = Settings::default_ao_radius(bvh.bounds);
    let settings = Settings { width, height, ao_radius, ..Settings::default() };
    let camera = scene::select_camera(scene, None).unwrap();
    twin_rays(bvh, &Tables::new(scene), &settings.frame(&camera), kind)
}

fn on_twin(bvh: &Bvh, rays: &[Ray], query: Query, options: &TracerOptions) -> Outcome {
    let traced = TwinTracer::new(bvh, options).unwrap().trace(query, rays).unwrap();
    (traced.hits, traced.counters, traced.migration)
}

/// All bits of both, and the rounds.
fn assert_equal(what: &str, device: &Outcome, twin: &Outcome) {
    assert_eq!(hits_digest(&device.0), hits_digest(&twin.0), "{what}: digest of hits");
    assert_eq!(bytemuck::cast_slice::<_, u8>(&device.0), bytemuck::cast_slice::<_, u8>(&twin.0), "{what}: hits");
    assert_eq!(device.1, twin.1, "{what}: counters of rays");
    assert_eq!(device.2, twin.2, "{what}: rounds and SMs");
}

/// What must be the same in all strategies: hits, and what rays do in the tree.
fn assert_same_work(what: &str, outcome: &Outcome, direct: &Outcome) {
    assert_eq!(bytemuck::cast_slice::<_, u8>(&outcome.0), bytemuck::cast_slice::<_, u8>(&direct.0), "{what}: hits");
    let work = |c: &RayCounters| [c.node_visits, c.triangle_tests, c.leaf_visits, c.stack_operations];
    assert!(outcome.1.iter().map(work).eq(direct.1.iter().map(work)), "{what}: work of rays");
}

fn scenes() -> Vec<(String, Scene)> {
    let mut scenes = common::small_scenes();
    for name in ["cornell", "gallery"] {
        scenes.push((name.to_owned(), scene::load_slice(name, scene::builtin::builtin(name).unwrap()).unwrap()));
    }
    scenes
}

/// The twin alone, which is quick: three policies, five sizes, five numbers of SMs, all kinds of rays.
#[test]
fn every_partition_gives_the_hits_of_direct() {
    for (name, scene) in scenes() {
        let bvh = common::bvh(&scene);
        for kind in RayKind::ALL {
            let rays = rays(&scene, &bvh, kind, (40, 30));
            let direct = on_twin(&bvh, &rays, kind.query(), &TracerOptions::default());
            for policy in POLICIES {
                for sms in [1, 2, 8, 15, 32] {
                    let mut options = migrate(policy, sms);
                    options.machine.owners = if sms == 8 { Owners::Scattered } else { Owners::Adjacent };
                    let what = format!("{name}, {}, {policy}, {sms} SMs", kind.name());
                    assert_same_work(&what, &on_twin(&bvh, &rays, kind.query(), &options), &direct);
                }
            }
        }
    }
}

/// One digest over strategies, partitions and kinds of rays, on the device and the twin.
#[test]
fn gpu_migration_digests_equal_the_twins() {
    let Some(gpu) = common::gpu() else { return };
    for (name, scene) in scenes() {
        let bvh = common::bvh(&scene);
        for kind in RayKind::ALL {
            let rays = rays(&scene, &bvh, kind, (64, 48));
            let compare = |what: &str, options: &TracerOptions| {
                let what = format!("{name}, {}, {what}", kind.name());
                let (hits, counters, report) = trace_and_report(&gpu, &bvh, &rays, kind.query(), options);
                let outcome = (hits, counters, report);
                assert_equal(&what, &outcome, &on_twin(&bvh, &rays, kind.query(), options));
                outcome
            };
            let direct = compare("direct", &TracerOptions::default());
            let persistent = TracerOptions { strategy: Strategy::Persistent, ..TracerOptions::default() };
            assert_same_work(&name, &compare("persistent", &persistent), &direct);
            // Each partition with some number of SMs, each number with some partition of each policy.
            for (policy, sms) in POLICIES.into_iter().zip([1, 2, 8, 15, 32].into_iter().cycle()) {
                assert_same_work(&name, &compare(policy, &migrate(policy, sms)), &direct);
            }
        }
    }
}

#[test]
fn gpu_migration_of_a_million_triangles() {
    let Some(gpu) = common::gpu() else { return };
    let scene = scene::procedural::build("blob", 1_000_000, 1).unwrap();
    let bvh = common::bvh(&scene);
    for kind in [RayKind::Primary, RayKind::Diffuse] {
        let rays = rays(&scene, &bvh, kind, (128, 96));
        let direct = on_twin(&bvh, &rays, kind.query(), &TracerOptions::default());
        for policy in ["bytes:512KiB", "bytes:64KiB", "sah:64KiB", "level:8"] {
            let options = migrate(policy, 15);
            let device = trace_and_report(&gpu, &bvh, &rays, kind.query(), &options);
            assert_equal(policy, &device, &on_twin(&bvh, &rays, kind.query(), &options));
            assert_same_work(policy, &device, &direct);
        }
    }
}

/// A ray can be left anywhere in the tree and found again, by the kernels for either sort of driver.
#[test]
fn gpu_migration_survives_any_quota() {
    let Some(gpu) = common::gpu() else { return };
    let scene = scene::procedural::build("needles", 4_000, 1).unwrap();
    let bvh = common::bvh(&scene);
    let rays = rays(&scene, &bvh, RayKind::Primary, (16, 12));
    for (query, strategy) in
        [(Query::Closest, Strategy::Migrate), (Query::Any, Strategy::Migrate), (Query::Closest, Strategy::Persistent)]
    {
        let direct = on_twin(&bvh, &rays, query, &TracerOptions::default());
        for (limit, gpu_kernels) in [(1, false), (7, true), (100, false), (1000, true)] {
            let options = TracerOptions { strategy, step_limit: Some(limit), gpu_kernels, ..migrate("bytes:16KiB", 3) };
            let device = trace_and_report(&gpu, &bvh, &rays, query, &options);
            assert_same_work(&format!("{strategy:?}, {limit}"), &device, &direct);
            assert_equal(&format!("{strategy:?}, {limit}"), &device, &on_twin(&bvh, &rays, query, &options));
        }
    }
}

/// Room for one ray, or for none, which is made one: the rays go through one at a time, none is lost.
#[test]
fn gpu_queues_of_the_least_capacity_lose_nothing() {
    let Some(gpu) = common::gpu() else { return };
    let scene = scene::procedural::build("room", 2_000, 1).unwrap();
    let bvh = common::bvh(&scene);
    let rays = rays(&scene, &bvh, RayKind::Primary, (8, 8));
    let direct = on_twin(&bvh, &rays, Query::Closest, &TracerOptions::default());
    for most_rays in [0, 1, 7] {
        let tracer = Tracer::new(&gpu, &bvh, &migrate("bytes:4KiB", 4), most_rays).unwrap();
        let buffer = gpu.upload("rays", &rays).unwrap();
        let hits = gpu.buffer("hits", 16 * rays.len() as u64, Place::Device).unwrap();
        let mut stream = Stream::new(&gpu);
        let buffers = RayBuffers::new(&buffer, &hits);
        let report = tracer.trace(&mut stream, "trace", Query::Closest, &buffers, rays.len() as u32).unwrap().unwrap();
        assert_eq!(report.rays, rays.len() as u64);
        assert_eq!(gpu.download::<Hit>(&hits, 0..rays.len()).unwrap(), direct.0, "room for {most_rays}");
        let nothing = tracer.trace(&mut stream, "trace", Query::Closest, &buffers, 0).unwrap().unwrap();
        assert_eq!(nothing, MigrationReport::default());
    }
}

/// Trees of no, one and two triangles, dead rays among the live.
#[test]
fn gpu_migration_in_the_smallest_trees() {
    let Some(gpu) = common::gpu() else { return };
    let triangle = |z: f32| [[-1.0, -1.0, z], [1.0, -1.0, z], [0.0, 1.0, z]].map(glam::Vec3::from);
    for count in [0, 1, 2, 20] {
        let positions: Vec<_> = (0..count).map(|z| triangle(z as f32)).collect();
        let bvh = Bvh::build(&positions, caribou::bvh::Quality::default()).unwrap();
        let ray = |x: f32| Ray { origin: [x, 0.0, 9.0], t_min: 0.0, direction: [0.0, 0.0, -1.0], t_max: 100.0 };
        let rays = [ray(0.0), Ray::DEAD, ray(5.0), ray(0.1)];
        for policy in ["level:0", "level:1", "level:63", "bytes:384", "sah:1MiB"] {
            for sms in [1, 32] {
                let options = migrate(policy, sms);
                let device = trace_and_report(&gpu, &bvh, &rays, Query::Closest, &options);
                assert_equal(policy, &device, &on_twin(&bvh, &rays, Query::Closest, &options));
            }
        }
    }
}

/// The kernels of every strategy record the steps that the twin records.
#[test]
fn gpu_step_traces_equal_the_twins() {
    let Some(gpu) = common::gpu() else { return };
    let scene = scene::procedural::build("forest", 4_000, 1).unwrap();
    let bvh = common::bvh(&scene);
    for kind in [RayKind::Diffuse, RayKind::Ao] {
        let rays = rays(&scene, &bvh, kind, (40, 30));
        let which = sample(rays.len() as u64, 700);
        let twin = StepSample::by_twin(&bvh, kind.query(), &rays, which.clone());
        for (strategy, gpu_kernels) in Strategy::ALL.into_iter().flat_map(|s| [(s, false), (s, true)]) {
            let options = TracerOptions { strategy, gpu_kernels, ..migrate("bytes:4KiB", 4) };
            let tracer = Tracer::new(&gpu, &bvh, &options, rays.len() as u32).unwrap();
            let trace = StepSample::by_kernels(&gpu, &tracer, kind.query(), &rays, which.clone()).unwrap();
            assert_eq!(trace, twin, "{strategy:?}, {kind:?}, {gpu_kernels}");
        }
    }
}

/// Counters do not depend on the number of the host's threads.
#[test]
fn twin_migration_repeats_with_any_number_of_threads() {
    let scene = scene::procedural::build("forest", 4_000, 1).unwrap();
    let bvh = common::bvh(&scene);
    let rays = rays(&scene, &bvh, RayKind::Diffuse, (64, 48));
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| on_twin(&bvh, &rays, Query::Closest, &migrate("sah:4KiB", 8)))
    };
    let one = run(1);
    for threads in [2, 5] {
        assert_equal("threads", &run(threads), &one);
    }
}

#[test]
fn gpu_migration_refuses_more_warps_than_the_device_has() {
    let Some(gpu) = common::gpu() else { return };
    let most = gpu.info().limits.group_invocations / 32;
    let bvh = Bvh::build(&[], caribou::bvh::Quality::default()).unwrap();
    for (sms, warps_per_sm) in [(0, 1), (10_000, 1), (1, 0), (1, most + 1)] {
        let machine = MachineOptions { sms, warps_per_sm, ..MachineOptions::default() };
        let options = TracerOptions { machine, ..migrate("level:0", 1) };
        let options = TracerOptions { machine: MachineOptions { sms, warps_per_sm, ..options.machine }, ..options };
        let error = refused(&gpu, &bvh, &options);
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains("give a number from 1 to"), "{error}");
    }
}

fn refused(gpu: &Gpu, bvh: &Bvh, options: &TracerOptions) -> caribou::Error {
    Tracer::new(gpu, bvh, options, 1).err().unwrap()
}
