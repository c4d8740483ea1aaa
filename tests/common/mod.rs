//! What the integration tests share: devices, scenes, rays.
#![allow(dead_code, reason = "each test file uses a part")]
#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

use caribou::bvh::{Bvh, Quality};
use caribou::scene::{self, Scene};
use caribou::vulkan::{Gpu, GpuOptions};

/// The Vulkan device to test on, with validation where the layer is installed. Skips aloud without a
/// driver, unless `CARIBOU_REQUIRE_VULKAN` forbids it.
pub fn gpu() -> Option<Gpu> {
    let device = std::env::var("CARIBOU_DEVICE").ok();
    match Gpu::open(&GpuOptions { device, validate: false }) {
        Ok(gpu) => Some(gpu),
        Err(error) if std::env::var_os("CARIBOU_REQUIRE_VULKAN").is_some() => panic!("{error}"),
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
