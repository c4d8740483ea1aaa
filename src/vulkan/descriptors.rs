//! Descriptor sets of one recorder, from pools that are freed with it.

use std::sync::Arc;

use ash::vk;

use super::buffer::Buffer;
use super::context::Context;
use super::kernels::MAX_BINDINGS;
use super::pipeline::{Compiled, descriptor_type};

/// Sets a pool; a recorder with more takes more pools.
const SETS: u32 = 64;

pub(super) struct Descriptors {
    context: Arc<Context>,
    pools: Vec<vk::DescriptorPool>,
    left: u32,
}

/// A buffer as a kernel sees it.
enum Shown {
    Storage([vk::DescriptorBufferInfo; 1]),
    Texels([vk::BufferView; 1]),
}

impl Descriptors {
    pub fn new(context: &Arc<Context>) -> Self {
        Self { context: context.clone(), pools: Vec::new(), left: 0 }
    }

    /// A set that shows `buffers` at bindings 0, 1, ..., as texels where the kernel takes them so.
    pub fn set(&mut self, pipeline: &Compiled, buffers: &[&Buffer]) -> Result<vk::DescriptorSet, vk::Result> {
        let device = &self.context.device;
        if self.left == 0 {
            let sizes = [vk::DescriptorType::STORAGE_BUFFER, vk::DescriptorType::UNIFORM_TEXEL_BUFFER]
                .map(|ty| vk::DescriptorPoolSize::default().ty(ty).descriptor_count(SETS * MAX_BINDINGS));
            let info = vk::DescriptorPoolCreateInfo::default().max_sets(SETS).pool_sizes(&sizes);
            // SAFETY: the device is alive; `info` points to live data.
            self.pools.push(unsafe { device.create_descriptor_pool(&info, None) }?);
            self.left = SETS;
        }
        let Some(&pool) = self.pools.last() else { unreachable!("a pool was pushed before `left` grew") };
        let layouts = [pipeline.set_layout];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
        // SAFETY: the pool has a set left, with the most descriptors that any layout asks for.
        let set = unsafe { device.allocate_descriptor_sets(&info) }?[0];
        self.left -= 1;
        let interface = pipeline.kernel.interface();
        let shown = (0..).zip(buffers).map(|(binding, buffer)| match descriptor_type(interface, binding) {
            vk::DescriptorType::UNIFORM_TEXEL_BUFFER => Ok(Shown::Texels([buffer.0.texels()?])),
            _ => Ok(Shown::Storage([vk::DescriptorBufferInfo::default().buffer(buffer.0.raw).range(buffer.bytes())])),
        });
        let shown = shown.collect::<Result<Vec<_>, vk::Result>>()?;
        let writes: Vec<_> = (0..)
            .zip(&shown)
            .map(|(binding, shown)| {
                let ty = descriptor_type(interface, binding);
                let written = vk::WriteDescriptorSet::default().dst_set(set).dst_binding(binding).descriptor_type(ty);
                match shown {
                    Shown::Storage(info) => written.buffer_info(info),
                    Shown::Texels(view) => written.texel_buffer_view(view),
                }
            })
            .collect();
        // SAFETY: the set is fresh, and has one binding of the kind written for each of `buffers` (the
        // recorder compared the counts).
        unsafe { device.update_descriptor_sets(&writes, &[]) };
        Ok(set)
    }
}

impl Drop for Descriptors {
    fn drop(&mut self) {
        for &pool in &self.pools {
            // SAFETY: the recorder drops this after its commands are done or never were submitted.
            unsafe { self.context.device.destroy_descriptor_pool(pool, None) };
        }
    }
}
