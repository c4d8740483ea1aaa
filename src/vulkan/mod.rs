//! Vulkan compute without a window: device, memory, the one table of kernels, submission,
//! timestamps. The only module that knows ash.
//!
//! ```no_run
//! use caribou::vulkan::{Gpu, GpuOptions, Kernel, Place};
//!
//! # fn main() -> caribou::Result<()> {
//! let gpu = Gpu::open(&GpuOptions::default())?;
//! let steps = gpu.upload("steps", &[70_000u32])?;
//! let states = gpu.buffer("states", 32 * 4, Place::Device)?;
//! let kernel = gpu.pipeline(Kernel::ProbeLoop, &[])?;
//! let mut recorder = gpu.recorder("example")?;
//! recorder.timestamp("loop")?;
//! recorder.dispatch(&kernel, &[&steps, &states], &[], 1)?;
//! let timings = recorder.submit()?;
//! println!("{:?}", timings.spans);
//! println!("{:?}", gpu.download::<u32>(&states, 0..32)?);
//! # Ok(())
//! # }
//! ```

mod buffer;
mod cache;
mod cases;
mod context;
mod descriptors;
mod error;
mod gpu;
mod instance;
mod invocations;
mod kernels;
mod pipeline;
mod probe;
mod recorder;
mod select;
pub mod specialised;
mod timestamps;
mod transfer;
mod validation;

pub use buffer::{Buffer, Place};
pub use gpu::{Gpu, GpuOptions, list_devices};
pub use kernels::{Interface, Kernel};
pub use pipeline::Pipeline;
pub use probe::Probe;
pub use recorder::Recorder;
pub use select::{DeviceInfo, DeviceKind, DriverCounters, Heap, Limits};
pub use timestamps::{Span, Timings, ticks_between};
