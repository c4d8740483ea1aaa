//! [`Gpu`]: an open device, and what can be made from it.

use std::borrow::Cow;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use super::cache::DiskCache;
use super::context::Context;
use super::instance::Instance;
use super::kernels::Kernel;
use super::pipeline::{Pipeline, PipelineMap};
use super::probe::{self, Probe};
use super::recorder::Recorder;
use super::select::{self, DeviceInfo};
use crate::{Error, Result};

/// How to open a device.
#[derive(Clone, Debug, Default)]
pub struct GpuOptions {
    /// Index in the list of devices, or part of a name in any case; `None`: the first discrete GPU, else
    /// an integrated one, a virtual one, a software driver.
    pub device: Option<String>,
    /// Runs under the Khronos validation layer (core and synchronization validation).
    pub validate: bool,
    /// A folder whose files `NAME.spv` stand in for the built-in kernels of that name: lets authors of kernels
    /// try one without a build, and tests plant faults.
    pub kernels: Option<PathBuf>,
}

/// An open Vulkan device. Work from several threads is serialised.
pub struct Gpu {
    pub(super) context: Arc<Context>,
    pipelines: Mutex<PipelineMap>,
    cache: DiskCache,
    probe: Probe,
    kernels: Option<PathBuf>,
}

impl Gpu {
    /// Opens a device and probes it.
    ///
    /// # Errors
    /// [`crate::Error::Device`] without loader, driver, usable device or validation layer;
    /// [`crate::Error::Usage`] for an unknown device, or a folder without kernels.
    pub fn open(options: &GpuOptions) -> Result<Self> {
        let without = |folder: &&PathBuf| !Kernel::ALL.iter().any(|kernel| kernel.file_in(folder).exists());
        if let Some(folder) = options.kernels.iter().find(without) {
            let remedy = "name a folder with a kernel's file, such as direct.spv";
            return Err(Error::usage(format!("no kernels in {}", folder.display()), remedy));
        }
        let instance = Instance::new(options.validate)?;
        let candidate = select::choose(select::enumerate(&instance)?, options.device.as_deref())?;
        let context = Arc::new(Context::new(instance, candidate)?);
        let cache = DiskCache::load(&context)?;
        let mut gpu = Self {
            context,
            pipelines: Mutex::default(),
            cache,
            probe: Probe::default(),
            kernels: options.kernels.clone(),
        };
        gpu.probe = probe::run(&gpu)?;
        Ok(gpu)
    }

    /// What the driver says about the device.
    pub fn info(&self) -> &DeviceInfo {
        &self.context.info
    }

    /// What the device was found to do when it was opened.
    pub fn probe(&self) -> &Probe {
        &self.probe
    }

    /// A pipeline with specialization constants `(id, value)`; compiled once, then shared.
    ///
    /// # Errors
    /// [`crate::Error::Device`] when the kernel is beyond the device's limits or does not compile.
    pub fn pipeline(&self, kernel: Kernel, spec: &[(u32, u32)]) -> Result<Pipeline> {
        let mut pipelines = self.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        let key = (kernel, spec.to_vec());
        if let Some(pipeline) = pipelines.get(&key) {
            return Ok(pipeline.clone());
        }
        let replaced = self.kernels.iter().map(|folder| kernel.file_in(folder));
        let code = match replaced.into_iter().find(|path| path.exists()) {
            Some(path) => std::fs::read(&path).map_err(Error::io("read", &path))?.into(),
            None => Cow::Borrowed(kernel.spirv()),
        };
        let pipeline = Pipeline::new(&self.context, self.cache.raw(), (kernel, &code), spec)?;
        pipelines.insert(key, pipeline.clone());
        Ok(pipeline)
    }

    /// An empty list of commands; `stage` names it in errors.
    pub fn recorder(&self, stage: &str) -> Result<Recorder> {
        Recorder::new(&self.context, stage)
    }

    /// Warnings and errors of the validation layer so far; empty without [`GpuOptions::validate`].
    pub fn validation_messages(&self) -> Vec<String> {
        self.context.instance.messages.all()
    }
}

/// All Vulkan devices of this machine, usable or not.
///
/// # Errors
/// [`crate::Error::Device`] without a loader or driver.
pub fn list_devices() -> Result<Vec<DeviceInfo>> {
    let instance = Instance::new(false)?;
    Ok(select::enumerate(&instance)?.into_iter().map(|candidate| candidate.info).collect())
}

/// A device for unit tests. Without one the test skips aloud; it fails where `CARIBOU_REQUIRE_VULKAN=1`.
#[cfg(test)]
pub(crate) fn for_test(validate: bool) -> Option<Gpu> {
    match Gpu::open(&GpuOptions { validate, ..GpuOptions::default() }) {
        Ok(gpu) => Some(gpu),
        Err(error) if std::env::var_os("CARIBOU_REQUIRE_VULKAN").is_some_and(|value| value != "0") => {
            panic!("CARIBOU_REQUIRE_VULKAN is set, but: {error}")
        }
        Err(error) => {
            eprintln!("SKIPPED: {error}");
            None
        }
    }
}
