//! Caribou: a headless glTF-to-OpenEXR ray tracer on Vulkan compute, and a laboratory for thread
//! migration between BVH subtrees. ARCHITECTURE.md maps the modules.

pub mod atomic_file;
pub mod bvh;
pub mod cli;
pub mod error;
pub mod fermi;
pub mod layout;
pub mod render;
pub mod report;
pub mod scene;
pub mod statistics;
pub mod trace;
pub mod twin;
#[allow(unsafe_code, reason = "the one module that talks to the Vulkan driver")]
pub mod vulkan;

/// Constants that host and kernels share, generated from `glsl/include/shared.glsl`.
#[allow(clippy::excessive_precision, reason = "powers of two are written with all their digits, as in GLSL")]
pub mod shared {
    include!(concat!(env!("OUT_DIR"), "/shared.rs"));
}

pub use error::{Error, Result};
