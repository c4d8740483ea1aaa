//! [`Buffer`]: memory of the device.

use std::ptr::NonNull;
use std::sync::atomic::Ordering;
use std::sync::{Arc, OnceLock};

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};

use super::context::Context;
use super::error::{allocation, failed, too_large};
use super::gpu::Gpu;
use crate::Result;
use crate::shared::TEXEL_BYTES;

/// Where a buffer lives and who touches it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Near the device; the host reads and writes it through staging where it cannot see it.
    Device,
    /// Written by the host, read by the device.
    Upload,
    /// Written by the device, read by the host.
    Readback,
}

/// A storage buffer, which kernels may also read as texels. Freed when dropped and no longer in a recorder.
pub struct Buffer(pub(super) Arc<Memory>);

/// The buffer's handle and memory.
pub(super) struct Memory {
    pub raw: vk::Buffer,
    pub label: String,
    pub bytes: u64,
    pub context: Arc<Context>,
    address: u64,
    place: Place,
    allocation: Option<Allocation>,
    texels: OnceLock<vk::BufferView>,
}

impl Buffer {
    /// Address on the device, for kernels that reach the buffer by reference. A recorder does not see
    /// such a use: see [`super::Recorder::keep`].
    pub fn address(&self) -> u64 {
        self.0.address
    }

    /// Size in bytes: a multiple of 4, at least 16 for a buffer made with none.
    pub fn bytes(&self) -> u64 {
        self.0.bytes
    }

    /// The name given at creation.
    pub fn label(&self) -> &str {
        &self.0.label
    }
}

impl Gpu {
    /// A buffer of `bytes` (rounded up to a multiple of 4; none become 16) with undefined content.
    ///
    /// # Errors
    /// [`crate::Error::Device`] naming `label` when the device has not that much memory.
    pub fn buffer(&self, label: &str, bytes: u64, place: Place) -> Result<Buffer> {
        let limits = &self.context.info.limits;
        let size = if bytes == 0 { 16 } else { bytes.checked_next_multiple_of(4).unwrap_or(u64::MAX) };
        if size > limits.allocation {
            return Err(too_large(label, bytes, "the driver allows in one allocation", limits.allocation));
        }
        if size > self.context.available() {
            return Err(too_large(label, bytes, "the device's memory has left", self.context.available()));
        }
        Memory::new(&self.context, label, size, place).map(|memory| Buffer(Arc::new(memory)))
    }
}

impl Memory {
    fn new(context: &Arc<Context>, label: &str, bytes: u64, place: Place) -> Result<Self> {
        use vk::BufferUsageFlags as Usage;
        let stage = format!("allocate {label}");
        let info = vk::BufferCreateInfo::default().size(bytes).usage(
            Usage::STORAGE_BUFFER
                | Usage::UNIFORM_TEXEL_BUFFER
                | Usage::TRANSFER_SRC
                | Usage::TRANSFER_DST
                | Usage::INDIRECT_BUFFER
                | Usage::SHADER_DEVICE_ADDRESS,
        );
        // SAFETY: the device is alive; `info` is complete.
        let raw = unsafe { context.device.create_buffer(&info, None) }.map_err(failed(&stage, "vkCreateBuffer"))?;
        context.allocated().fetch_add(bytes, Ordering::Relaxed);
        // From here on, dropping `memory` undoes what was done.
        let mut memory = Self {
            raw,
            label: label.to_owned(),
            bytes,
            context: context.clone(),
            address: 0,
            place,
            allocation: None,
            texels: OnceLock::new(),
        };
        // SAFETY: `raw` was made from this device.
        let requirements = unsafe { context.device.get_buffer_memory_requirements(raw) };
        let request = AllocationCreateDesc {
            name: label,
            requirements,
            location: match place {
                Place::Device => MemoryLocation::GpuOnly,
                Place::Upload => MemoryLocation::CpuToGpu,
                Place::Readback => MemoryLocation::GpuToCpu,
            },
            linear: true,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        };
        let granted = context.allocator().allocate(&request).map_err(|error| allocation(label, bytes, &error))?;
        // SAFETY: the allocation is fresh, of this device and meets the buffer's requirements. It is
        // kept until the buffer is destroyed.
        let bound = unsafe { context.device.bind_buffer_memory(raw, granted.memory(), granted.offset()) };
        memory.allocation = Some(granted);
        bound.map_err(failed(&stage, "vkBindBufferMemory"))?;
        let info = vk::BufferDeviceAddressInfo::default().buffer(raw);
        // SAFETY: the buffer is bound, with the usage and the memory flag that this needs.
        memory.address = unsafe { context.device.get_buffer_device_address(&info) };
        Ok(memory)
    }

    /// The memory as the host sees it, if it sees it without flushing.
    pub fn mapped(&self) -> Option<NonNull<u8>> {
        let allocation = self.allocation.as_ref()?;
        let coherent = allocation.memory_properties().contains(vk::MemoryPropertyFlags::HOST_COHERENT);
        allocation.mapped_ptr().filter(|_| coherent).map(NonNull::cast)
    }

    /// The memory as texels, made when first asked for. What is left of it after the last whole texel does not show.
    pub fn texels(&self) -> Result<vk::BufferView, vk::Result> {
        if let Some(&view) = self.texels.get() {
            return Ok(view);
        }
        let info = vk::BufferViewCreateInfo::default()
            .buffer(self.raw)
            .format(vk::Format::R32G32B32A32_UINT)
            .range(self.bytes - self.bytes % u64::from(TEXEL_BYTES));
        // SAFETY: the buffer is bound, with the usage that this needs; all devices read texels of this format.
        let view = unsafe { self.context.device.create_buffer_view(&info, None) }?;
        if let Err(second) = self.texels.set(view) {
            // SAFETY: another thread was first; nothing uses this view.
            unsafe { self.context.device.destroy_buffer_view(second, None) };
        }
        Ok(self.texels.get().copied().unwrap_or(view))
    }

    /// Reading through [`Memory::mapped`] is fast: not so from uncached memory across a bus.
    pub fn reads_fast(&self) -> bool {
        let cached = vk::MemoryPropertyFlags::HOST_CACHED;
        self.place == Place::Readback
            || self.allocation.as_ref().is_some_and(|a| a.memory_properties().contains(cached))
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        // SAFETY: recorders hold what they use, so no command refers to the buffer any more.
        unsafe {
            if let Some(&view) = self.texels.get() {
                self.context.device.destroy_buffer_view(view, None);
            }
            self.context.device.destroy_buffer(self.raw, None);
        }
        if let Some(allocation) = self.allocation.take()
            && let Err(error) = self.context.allocator().free(allocation)
        {
            tracing::error!("free {}: {error}", self.label);
        }
        self.context.allocated().fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vulkan::gpu;

    /// As if other buffers had filled the memory; to fill it would take the machine's.
    #[test]
    fn buffers_that_fit_alone_but_not_together_are_refused() {
        let Some(gpu) = gpu::for_test(false) else { return };
        let before = gpu.context.available();
        let buffer = gpu.buffer("first", 4096, Place::Device).unwrap();
        assert_eq!(gpu.context.available(), before - 4096);
        gpu.context.allocated().fetch_add(before - 8192, Ordering::Relaxed);
        assert!(gpu.buffer("fits", 4096, Place::Device).is_ok());
        let error = gpu.buffer("second", 4100, Place::Device).map(drop).unwrap_err().to_string();
        assert!(error.contains("allocate second: 4100 bytes") && error.contains("(4096 bytes)"), "{error}");
        gpu.context.allocated().fetch_sub(before - 8192, Ordering::Relaxed);
        drop(buffer);
        assert_eq!(gpu.context.available(), before);
    }
}
