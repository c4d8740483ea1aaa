//! What the integration tests share: devices, scenes, rays.
#![allow(dead_code, reason = "each test file uses a part")]
#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

pub mod closed;
pub mod exr;

use caribou::bvh::{Bvh, Quality};
use caribou::layout::{Hit, Ray, RayCounters};
use caribou::scene::{self, Scene};
use caribou::trace::{Geometry, Query, Stream, Tracer, TracerOptions};
use caribou::vulkan::{Gpu, GpuOptions, Place};

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
    let open = |validate| Gpu::open(&GpuOptions { device: std::env::var("CARIBOU_DEVICE").ok(), validate });
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

/// Hits and counters of the device.
pub fn trace_on(
    gpu: &Gpu,
    bvh: &Bvh,
    rays: &[Ray],
    query: Query,
    options: TracerOptions,
) -> (Vec<Hit>, Vec<RayCounters>) {
    let tracer = Tracer::new(gpu, Geometry::upload(gpu, bvh).unwrap(), options).unwrap();
    let count = rays.len();
    let rays = gpu.upload("rays", rays).unwrap();
    let hits = gpu.buffer("hits", 16 * count as u64, Place::Device).unwrap();
    let counters = gpu.buffer("counters", 8 * count as u64, Place::Device).unwrap();
    let mut stream = Stream::new(gpu);
    tracer.trace(&mut stream, "trace", query, (&rays, &hits, Some(&counters)), count as u32).unwrap();
    stream.finish().unwrap();
    (gpu.download(&hits, 0..count).unwrap(), gpu.download(&counters, 0..count).unwrap())
}

/// The kernels that the device would use, and those for GPUs.
pub fn both_kernels(step_limit: Option<u32>) -> [TracerOptions; 2] {
    [false, true].map(|gpu_kernels| TracerOptions { step_limit, gpu_kernels, ..TracerOptions::default() })
}
