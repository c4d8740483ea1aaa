//! Which devices there are, what they can do, and which one is used.

use std::ffi::CStr;

use ash::{khr, vk};
use serde::Serialize;

use super::context::has_extension;
use super::error::failed;
use super::instance::{API_VERSION, Instance};
use crate::shared::TEXEL_BYTES;
use crate::{Error, Result};

/// A Vulkan device as its driver describes it.
#[derive(Clone, Debug, Serialize)]
pub struct DeviceInfo {
    /// Position in the loader's list; what `--device INDEX` means.
    pub index: usize,
    /// The driver's name of the device.
    pub name: String,
    /// What sort of device it is.
    pub kind: DeviceKind,
    /// The vendor's name, or its PCI id.
    pub vendor: String,
    /// The driver's name.
    pub driver: String,
    /// The driver's version in its own terms.
    pub driver_version: String,
    /// Vulkan version, e.g. `1.3.230`.
    pub api_version: String,
    /// Invocations a subgroup.
    pub subgroup_size: u32,
    /// Streaming multiprocessors, where kernels can tell which they run on (VK_NV_shader_sm_builtins).
    pub sms: Option<u32>,
    /// What the driver can count.
    pub driver_counters: DriverCounters,
    /// Limits that this program meets.
    pub limits: Limits,
    /// Memory heaps in the driver's order.
    pub heaps: Vec<Heap>,
    /// Names device model and driver build; 32 hexadecimal digits.
    pub uuid: String,
    /// Why this program cannot use the device, if so.
    pub unusable: Option<String>,
}

/// What sort of device it is, the most wanted first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum DeviceKind {
    /// A GPU with memory of its own.
    Discrete,
    /// A GPU that shares the host's memory.
    Integrated,
    /// A GPU of a virtual machine.
    Virtual,
    /// A software driver.
    Cpu,
    /// Anything else.
    Other,
}

/// Which counters of its own a driver offers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct DriverCounters {
    /// Invocations of kernels (feature pipelineStatisticsQuery).
    pub pipeline_statistics: bool,
    /// Counters of the hardware (VK_KHR_performance_query). They are not read.
    pub performance_query: bool,
}

/// A memory heap.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Heap {
    /// Size in bytes.
    pub bytes: u64,
    /// Near to the device.
    pub device_local: bool,
}

/// Limits of a device that this program meets.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Limits {
    /// Most bytes a storage-buffer binding shows.
    pub storage_buffer_range: u64,
    /// Most storage buffers a kernel binds.
    pub storage_buffers: u32,
    /// Most bytes a binding of texels shows.
    pub texel_buffer_range: u64,
    /// Most buffers of texels a kernel binds.
    pub texel_buffers: u32,
    /// Most bytes of one memory allocation.
    pub allocation: u64,
    /// Most workgroups a dispatch (in x).
    pub groups: u32,
    /// Most invocations a workgroup (in x).
    pub group_invocations: u32,
    /// Bytes of shared memory a workgroup.
    pub shared_memory: u32,
    /// Bytes of push constants.
    pub push_constants: u32,
    /// Seconds a timestamp tick; 0 without timestamps.
    pub timestamp_period: f64,
}

/// A device that can be chosen.
pub(super) struct Candidate {
    pub physical: vk::PhysicalDevice,
    pub queue_family: u32,
    pub timestamp_bits: u32,
    pub info: DeviceInfo,
}

/// All devices, in the loader's order.
pub(super) fn enumerate(instance: &Instance) -> Result<Vec<Candidate>> {
    // SAFETY: the instance is alive.
    let devices = match unsafe { instance.raw.enumerate_physical_devices() } {
        // What the loader says when there are drivers, and hardware for none of them.
        Err(vk::Result::ERROR_INITIALIZATION_FAILED) => return Err(Instance::no_device()),
        devices => devices.map_err(failed("open device", "vkEnumeratePhysicalDevices"))?,
    };
    Ok(devices.into_iter().enumerate().map(|(index, device)| describe(&instance.raw, index, device)).collect())
}

/// The device that `wanted` (an index, or part of a name in any case) means; without it, the first of
/// the most wanted kind.
pub(super) fn choose(candidates: Vec<Candidate>, wanted: Option<&str>) -> Result<Candidate> {
    if candidates.is_empty() {
        return Err(Instance::no_device());
    }
    let listing = candidates.iter().map(|c| format!("{} {}", c.info.index, c.info.name)).collect::<Vec<_>>().join(", ");
    let matching = |candidate: &Candidate| match wanted {
        None => true,
        Some(text) => match text.parse::<usize>() {
            Ok(index) => candidate.info.index == index,
            Err(_) => candidate.info.name.to_lowercase().contains(&text.to_lowercase()),
        },
    };
    let rank = |candidate: &Candidate| (candidate.info.unusable.is_some(), candidate.info.kind, candidate.info.index);
    let chosen = candidates.into_iter().filter(matching).min_by_key(rank).ok_or_else(|| {
        let wanted = wanted.unwrap_or_default();
        Error::usage(format!("no Vulkan device is \"{wanted}\""), format!("known devices: {listing}"))
    })?;
    match &chosen.info.unusable {
        None => Ok(chosen),
        Some(reason) => Err(Error::device(
            "open device",
            format!("{} cannot be used: {reason}", chosen.info.name),
            format!("update its driver or choose another device (known: {listing})"),
        )),
    }
}

fn describe(instance: &ash::Instance, index: usize, physical: vk::PhysicalDevice) -> Candidate {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut subgroup = vk::PhysicalDeviceSubgroupProperties::default();
    let mut maintenance = vk::PhysicalDeviceMaintenance3Properties::default();
    let mut sm = vk::PhysicalDeviceShaderSMBuiltinsPropertiesNV::default();
    let mut properties = vk::PhysicalDeviceProperties2::default()
        .push_next(&mut sm)
        .push_next(&mut driver)
        .push_next(&mut subgroup)
        .push_next(&mut maintenance);
    let mut address = vk::PhysicalDeviceBufferDeviceAddressFeatures::default();
    let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut address);
    // SAFETY: the instance is alive and `physical` is one of its devices; a driver leaves structures
    // that it does not know untouched.
    let (memory, families) = unsafe {
        instance.get_physical_device_properties2(physical, &mut properties);
        instance.get_physical_device_features2(physical, &mut features);
        (
            instance.get_physical_device_memory_properties(physical),
            instance.get_physical_device_queue_family_properties(physical),
        )
    };
    let pipeline_statistics = features.features.pipeline_statistics_query == vk::TRUE;
    // A device whose extensions cannot be listed is told by the error when it is opened.
    let performance_query = has_extension(instance, physical, khr::performance_query::NAME).unwrap_or(false);
    let properties = properties.properties;
    let family = compute_family(&families);
    let timestamp_bits = family.map_or(0, |family| families[family as usize].timestamp_valid_bits);
    let version = properties.api_version;
    let unusable = if version < API_VERSION {
        Some("it offers less than Vulkan 1.2".to_owned())
    } else if family.is_none() {
        Some("it has no compute queue".to_owned())
    } else if address.buffer_device_address == vk::FALSE {
        Some("it has no buffer device addresses (feature bufferDeviceAddress)".to_owned())
    } else {
        None
    };
    let info = DeviceInfo {
        index,
        name: text(&properties.device_name),
        kind: kind(properties.device_type),
        vendor: vendor(properties.vendor_id),
        driver: text(&driver.driver_name),
        driver_version: text(&driver.driver_info),
        api_version: format!(
            "{}.{}.{}",
            vk::api_version_major(version),
            vk::api_version_minor(version),
            vk::api_version_patch(version)
        ),
        subgroup_size: subgroup.subgroup_size,
        sms: Some(sm.shader_sm_count).filter(|&count| count > 0),
        driver_counters: DriverCounters { pipeline_statistics, performance_query },
        limits: limits(&properties.limits, &maintenance, timestamp_bits),
        heaps: memory
            .memory_heaps_as_slice()
            .iter()
            .map(|heap| Heap { bytes: heap.size, device_local: heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL) })
            .collect(),
        uuid: properties.pipeline_cache_uuid.iter().map(|byte| format!("{byte:02x}")).collect(),
        unusable,
    };
    Candidate { physical, queue_family: family.unwrap_or(0), timestamp_bits, info }
}

/// A family that computes and does not draw, if there is one with timestamps: there nothing else competes.
fn compute_family(families: &[vk::QueueFamilyProperties]) -> Option<u32> {
    let computes = |family: &&(u32, &vk::QueueFamilyProperties)| {
        family.1.queue_flags.contains(vk::QueueFlags::COMPUTE) && family.1.queue_count > 0
    };
    let families: Vec<_> = (0..).zip(families).collect();
    families
        .iter()
        .filter(computes)
        .min_by_key(|(_, f)| (f.timestamp_valid_bits == 0, f.queue_flags.contains(vk::QueueFlags::GRAPHICS)))
        .map(|(index, _)| *index)
}

fn limits(
    limits: &vk::PhysicalDeviceLimits,
    maintenance: &vk::PhysicalDeviceMaintenance3Properties<'_>,
    timestamp_bits: u32,
) -> Limits {
    Limits {
        storage_buffer_range: limits.max_storage_buffer_range.into(),
        storage_buffers: limits.max_per_stage_descriptor_storage_buffers.min(limits.max_descriptor_set_storage_buffers),
        texel_buffer_range: u64::from(limits.max_texel_buffer_elements) * u64::from(TEXEL_BYTES),
        texel_buffers: limits.max_per_stage_descriptor_sampled_images.min(limits.max_descriptor_set_sampled_images),
        allocation: maintenance.max_memory_allocation_size,
        groups: limits.max_compute_work_group_count[0],
        group_invocations: limits.max_compute_work_group_invocations.min(limits.max_compute_work_group_size[0]),
        shared_memory: limits.max_compute_shared_memory_size,
        push_constants: limits.max_push_constants_size,
        timestamp_period: if timestamp_bits == 0 { 0.0 } else { f64::from(limits.timestamp_period) * 1e-9 },
    }
}

fn kind(kind: vk::PhysicalDeviceType) -> DeviceKind {
    match kind {
        vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
        vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
        vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
        vk::PhysicalDeviceType::CPU => DeviceKind::Cpu,
        _ => DeviceKind::Other,
    }
}

/// PCI ids, and Khronos ids from 0x10000 on (`VkVendorId` in the Vulkan registry).
fn vendor(id: u32) -> String {
    let name = match id {
        0x1002 => "AMD",
        0x1010 => "Imagination",
        0x106B => "Apple",
        0x10DE => "NVIDIA",
        0x13B5 => "ARM",
        0x1AE0 => "Google",
        0x5143 => "Qualcomm",
        0x8086 => "Intel",
        0x10005 => "Mesa",
        other => return format!("{other:#06x}"),
    };
    name.to_owned()
}

/// A string in a fixed array of a Vulkan structure.
pub(super) fn text(chars: &[std::ffi::c_char]) -> String {
    let bytes: &[u8] = bytemuck::cast_slice(chars);
    CStr::from_bytes_until_nul(bytes).map_or_else(|_| String::new(), |text| text.to_string_lossy().into_owned())
}
