//! The machine that a report is of.

use serde::Serialize;

use crate::vulkan::{DeviceInfo, Gpu, Probe};

/// Device, driver and host.
#[derive(Clone, Debug, Serialize)]
pub struct Machine {
    /// The Vulkan device's name, or `twin` for the CPU twin.
    pub device: String,
    /// The program's version.
    pub caribou: &'static str,
    /// Operating system and processor architecture.
    pub host: String,
    /// Threads of the host.
    pub threads: usize,
    /// What the driver says of the device.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vulkan: Option<DeviceInfo>,
    /// What was found at the start.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub probe: Option<Probe>,
}

impl Machine {
    /// This machine with `gpu`, or with the twin.
    pub fn new(gpu: Option<&Gpu>) -> Machine {
        Machine {
            device: gpu.map_or("twin".to_owned(), |gpu| gpu.info().name.clone()),
            caribou: env!("CARGO_PKG_VERSION"),
            host: format!("{}-{}", std::env::consts::OS, std::env::consts::ARCH),
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            vulkan: gpu.map(|gpu| gpu.info().clone()),
            probe: gpu.map(|gpu| *gpu.probe()),
        }
    }
}
