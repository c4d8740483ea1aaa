//! What buffers, pipelines and recorders share: the logical device, its queue, its memory.

use std::ffi::CStr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use ash::{khr, nv, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use gpu_allocator::{AllocationSizes, AllocatorDebugSettings};

use super::error::failed;
use super::instance::Instance;
use super::select::{Candidate, DeviceInfo};
use crate::{Error, Result};

const STAGE: &str = "open device";
const MIB: u64 = 1 << 20;

/// Fields drop in this order: memory, device, instance.
pub(super) struct Context {
    allocator: Mutex<Allocator>,
    queue: Mutex<vk::Queue>,
    allocated: AtomicU64,
    /// Reads statistics of compiled pipelines, where the driver offers them.
    pub executables: Option<khr::pipeline_executable_properties::Device>,
    pub device: LogicalDevice,
    pub queue_family: u32,
    pub timestamp_bits: u32,
    pub info: DeviceInfo,
    pub instance: Instance,
}

/// A logical device, destroyed on drop.
pub(super) struct LogicalDevice(ash::Device);

impl Context {
    pub fn new(instance: Instance, candidate: Candidate) -> Result<Self> {
        let Candidate { physical, queue_family, timestamp_bits, info } = candidate;
        let executables = khr::pipeline_executable_properties::NAME;
        let has_executables = has_extension(&instance.raw, physical, executables)?;
        let mut extensions = Vec::new();
        if has_executables {
            extensions.push(executables.as_ptr());
        }
        if info.sms.is_some() {
            extensions.push(nv::shader_sm_builtins::NAME.as_ptr());
        }
        let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(queue_family).queue_priorities(&[1.0])];
        let mut address = vk::PhysicalDeviceBufferDeviceAddressFeatures::default().buffer_device_address(true);
        let mut executable =
            vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default().pipeline_executable_info(true);
        let mut sm = vk::PhysicalDeviceShaderSMBuiltinsFeaturesNV::default().shader_sm_builtins(true);
        let features =
            vk::PhysicalDeviceFeatures::default().pipeline_statistics_query(info.driver_counters.pipeline_statistics);
        let mut create = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_features(&features)
            .enabled_extension_names(&extensions)
            .push_next(&mut address);
        if has_executables {
            create = create.push_next(&mut executable);
        }
        if info.sms.is_some() {
            create = create.push_next(&mut sm);
        }
        // SAFETY: `create` points to live data and asks only for what the device was seen to have.
        let device = unsafe { instance.raw.create_device(physical, &create, None) }
            .map(LogicalDevice)
            .map_err(failed(STAGE, "vkCreateDevice"))?;
        // SAFETY: the device was made with one queue of this family.
        let queue = unsafe { device.get_device_queue(queue_family, 0) };
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.raw.clone(),
            device: device.0.clone(),
            physical_device: physical,
            debug_settings: AllocatorDebugSettings::default(),
            buffer_device_address: true,
            // Small first blocks keep small runs small; a buffer above the block size gets its own memory.
            allocation_sizes: AllocationSizes::new(4 * MIB, 4 * MIB)
                .with_max_device_memblock_size(64 * MIB)
                .with_max_host_memblock_size(64 * MIB),
        })
        .map_err(|error| Error::device(STAGE, format!("memory: {error}"), "update the Vulkan driver"))?;
        Ok(Self {
            allocator: Mutex::new(allocator),
            queue: Mutex::new(queue),
            allocated: AtomicU64::new(0),
            executables: has_executables
                .then(|| khr::pipeline_executable_properties::Device::new(&instance.raw, &device)),
            device,
            queue_family,
            timestamp_bits,
            info,
            instance,
        })
    }

    /// The queue, and with it the right to touch mapped memory: while it is held, the device is idle.
    pub fn queue(&self) -> MutexGuard<'_, vk::Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn allocator(&self) -> MutexGuard<'_, Allocator> {
        self.allocator.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Bytes in live buffers.
    pub fn allocated(&self) -> &AtomicU64 {
        &self.allocated
    }

    /// Bytes that could still be allocated beside the live buffers, by the largest heap.
    pub fn available(&self) -> u64 {
        let largest = self.info.heaps.iter().map(|heap| heap.bytes).max().unwrap_or(0);
        largest.saturating_sub(self.allocated.load(Ordering::Relaxed))
    }
}

impl std::ops::Deref for LogicalDevice {
    type Target = ash::Device;

    fn deref(&self) -> &ash::Device {
        &self.0
    }
}

impl Drop for LogicalDevice {
    fn drop(&mut self) {
        // SAFETY: every object made from the device holds the context, so all of them are gone; the
        // allocator was dropped before.
        unsafe { self.0.destroy_device(None) }
    }
}

/// Whether the device offers the extension `name`.
pub(super) fn has_extension(instance: &ash::Instance, physical: vk::PhysicalDevice, name: &CStr) -> Result<bool> {
    // SAFETY: the instance is alive and `physical` is one of its devices.
    let extensions = unsafe { instance.enumerate_device_extension_properties(physical) }
        .map_err(failed(STAGE, "vkEnumerateDeviceExtensionProperties"))?;
    Ok(extensions.iter().any(|extension| extension.extension_name_as_c_str() == Ok(name)))
}
