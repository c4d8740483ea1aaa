//! What the integration tests share: devices, scenes, rays.
#![allow(dead_code, reason = "each test file uses a part")]
#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

pub mod closed;
pub mod exr;
pub mod faults;

use caribou::bvh::{Bvh, Quality};
use caribou::layout::{Hit, Ray, RayCounters};
use caribou::scene::{self, Scene};
use caribou::trace::{MigrationReport, Query, RayBuffers, Stream, Tracer, TracerOptions};
use caribou::vulkan::{Gpu, GpuOptions, Place};
use glam::Vec3;

/// A device under core and synchronization validation: a test fails on any message.
pub struct Validated(Gpu);

impl std::ops::Deref for Validated {
    type Target = Gpu;

    fn deref(&self) -> &Gpu {
        &self.0
    }
}

impl Drop for Validated {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            assert_eq!(self.0.validation_messages(), [""; 0], "the validation layer complains");
        }
    }
}

/// The Vulkan device to test on, validated where the layer is installed. Skips aloud without a driver, unless
/// `CARIBOU_REQUIRE_VULKAN` forbids it.
pub fn gpu() -> Option<Validated> {
    gpu_with(&GpuOptions::default())
}

/// As [`gpu`], with further options.
pub fn gpu_with(options: &GpuOptions) -> Option<Validated> {
    let device = std::env::var("CARIBOU_DEVICE").ok();
    let open = |validate| Gpu::open(&GpuOptions { device: device.clone(), validate, ..options.clone() });
    let gpu = open(true).or_else(|error| open(false).inspect(|_| eprintln!("SKIPPED validation: {error}")));
    match gpu {
        Ok(gpu) => Some(Validated(gpu)),
        Err(error) if std::env::var_os("CARIBOU_REQUIRE_VULKAN").is_some_and(|value| value != "0") => {
            panic!("CARIBOU_REQUIRE_VULKAN is set, but: {error}")
        }
        Err(error) => {
            eprintln!("SKIPPED: {error}");
            None
        }
    }
}

/// Small procedural scenes of every kind, and the worst case.
pub fn small_scenes() -> Vec<(String, Scene)> {
    ["room", "forest", "blob", "needles"]
        .map(|name| (name.to_owned(), scene::procedural::build(name, 4_000, 1).unwrap()))
        .into()
}

/// The BVH at default quality.
pub fn bvh(scene: &Scene) -> Bvh {
    Bvh::build(&scene.positions, Quality::default()).unwrap()
}

/// Hits and counters of the device, which must not depend on the hint that rays are coherent.
pub fn trace_on(
    gpu: &Gpu,
    bvh: &Bvh,
    rays: &[Ray],
    query: Query,
    options: TracerOptions,
) -> (Vec<Hit>, Vec<RayCounters>) {
    let traced = |coherent| {
        let (hits, counters, _) = trace_as(gpu, bvh, (rays, coherent), query, &options);
        (hits, counters)
    };
    let coherent = traced(true);
    // The only kernels that take the hint.
    if options.step_limit.is_none() && !options.gpu_kernels {
        assert!(coherent == traced(false), "{options:?}: hits or counters depend on the hint");
    }
    coherent
}

/// Hits and counters of the device, with the report of strategy `migrate`.
pub fn trace_and_report(
    gpu: &Gpu,
    bvh: &Bvh,
    rays: &[Ray],
    query: Query,
    options: &TracerOptions,
) -> (Vec<Hit>, Vec<RayCounters>, Option<MigrationReport>) {
    trace_as(gpu, bvh, (rays, true), query, options)
}

/// The same, with the hint that rays are coherent or without it.
pub fn trace_as(
    gpu: &Gpu,
    bvh: &Bvh,
    (rays, coherent): (&[Ray], bool),
    query: Query,
    options: &TracerOptions,
) -> (Vec<Hit>, Vec<RayCounters>, Option<MigrationReport>) {
    let count = rays.len();
    let tracer = Tracer::new(gpu, bvh, options, count as u32).unwrap();
    let rays = gpu.upload("rays", rays).unwrap();
    let hits = gpu.buffer("hits", 16 * count as u64, Place::Device).unwrap();
    let counters = gpu.buffer("counters", (size_of::<RayCounters>() * count) as u64, Place::Device).unwrap();
    let mut stream = Stream::new(gpu);
    let buffers = RayBuffers::new(&rays, &hits).coherent(coherent).counted(&counters);
    let report = tracer.trace(&mut stream, "trace", query, &buffers, count as u32).unwrap();
    stream.finish().unwrap();
    (gpu.download(&hits, 0..count).unwrap(), gpu.download(&counters, 0..count).unwrap(), report)
}

/// The kernels that the device would use, and those for GPUs.
pub fn both_kernels(step_limit: Option<u32>) -> [TracerOptions; 2] {
    [false, true].map(|gpu_kernels| TracerOptions { step_limit, gpu_kernels, ..TracerOptions::default() })
}

/// Panics at the first ray whose hit or counters differ from the twin's in a bit.
pub fn assert_same(
    what: &str,
    device: &(Vec<Hit>, Vec<RayCounters>),
    twin: &(Vec<Hit>, Vec<RayCounters>),
    rays: &[Ray],
) {
    for (i, ray) in rays.iter().enumerate() {
        let same = bytemuck::bytes_of(&device.0[i]) == bytemuck::bytes_of(&twin.0[i]) && device.1[i] == twin.1[i];
        assert!(same, "{what}: {:?}, {:?} for {ray:?}", device.0[i], twin.0[i]);
    }
}

/// Rays from around the scene towards it, axis-parallel ones among them.
pub fn rays_around(scene: &Scene, count: u32) -> Vec<Ray> {
    let (low, high) = scene.bounds().unwrap();
    let (middle, size) = ((low + high) * 0.5, (high - low).length());
    let direction = |i| caribou::twin::sampling::sphere_direction(caribou::twin::random::random2(7, 0, 0, i));
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
