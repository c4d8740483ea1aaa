//! [`Pipeline`]: a kernel compiled for a device with its specialization constants.

use std::collections::HashMap;
use std::sync::Arc;

use ash::vk;

use super::context::Context;
use super::error::failed;
use super::kernels::{Interface, Kernel};
use crate::{Error, Result};

/// Pipelines by kernel and specialization constants.
pub(super) type PipelineMap = HashMap<(Kernel, Vec<(u32, u32)>), Pipeline>;

/// A compiled kernel; clones share it.
#[derive(Clone)]
pub struct Pipeline(pub(super) Arc<Compiled>);

/// Handles of a compiled kernel.
pub(super) struct Compiled {
    pub kernel: Kernel,
    pub raw: vk::Pipeline,
    pub layout: vk::PipelineLayout,
    pub set_layout: vk::DescriptorSetLayout,
    pub context: Arc<Context>,
}

impl Pipeline {
    /// The kernel that was compiled.
    pub fn kernel(&self) -> Kernel {
        self.0.kernel
    }

    /// What the driver says about the compiled kernel, e.g. its registers; names are the driver's.
    /// Empty where it says nothing, as software drivers do.
    pub fn statistics(&self) -> Vec<(String, u64)> {
        let Some(executables) = &self.0.context.executables else { return Vec::new() };
        let info = vk::PipelineExecutableInfoKHR::default().pipeline(self.0.raw).executable_index(0);
        // SAFETY: the pipeline was compiled with statistics captured, and every compute pipeline has
        // at least one executable.
        let statistics = unsafe { executables.get_pipeline_executable_statistics(&info) }.unwrap_or_default();
        statistics.iter().filter_map(|one| Some((super::select::text(&one.name), whole(one)?))).collect()
    }

    pub(super) fn new(
        context: &Arc<Context>,
        cache: vk::PipelineCache,
        (kernel, code): (Kernel, &[u8]),
        spec: &[(u32, u32)],
    ) -> Result<Self> {
        check_limits(context, kernel)?;
        let stage = format!("compile {}", kernel.name());
        // Dropping `compiled` undoes what was done so far; null handles are ignored.
        let mut compiled = Compiled {
            kernel,
            raw: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            set_layout: vk::DescriptorSetLayout::null(),
            context: context.clone(),
        };
        let takes = kernel.interface();
        let bindings: Vec<_> = (0..takes.bindings)
            .map(|binding| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding)
                    .descriptor_type(descriptor_type(takes, binding))
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::COMPUTE)
            })
            .collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: here and below the device is alive and each structure points to live data.
        compiled.set_layout = unsafe { context.device.create_descriptor_set_layout(&info, None) }
            .map_err(failed(&stage, "vkCreateDescriptorSetLayout"))?;
        let set_layouts = [compiled.set_layout];
        let push = [vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::COMPUTE).size(takes.push_bytes)];
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(&set_layouts)
            .push_constant_ranges(if push[0].size == 0 { &[] } else { &push });
        // SAFETY: see above.
        compiled.layout = unsafe { context.device.create_pipeline_layout(&info, None) }
            .map_err(failed(&stage, "vkCreatePipelineLayout"))?;
        compiled.raw = compile(context, cache, code, spec, compiled.layout, &stage)?;
        Ok(Self(Arc::new(compiled)))
    }
}

/// What a kernel has at a binding.
pub(super) fn descriptor_type(interface: Interface, binding: u32) -> vk::DescriptorType {
    match interface.texels.contains(&binding) {
        true => vk::DescriptorType::UNIFORM_TEXEL_BUFFER,
        false => vk::DescriptorType::STORAGE_BUFFER,
    }
}

fn compile(
    context: &Context,
    cache: vk::PipelineCache,
    code: &[u8],
    spec: &[(u32, u32)],
    layout: vk::PipelineLayout,
    stage: &str,
) -> Result<vk::Pipeline> {
    let words: Vec<u32> =
        code.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect();
    let module_info = vk::ShaderModuleCreateInfo::default().code(&words);
    // SAFETY: the device is alive; the words are SPIR-V that the build compiled for Vulkan 1.2, or for which
    // the author of `GpuOptions::kernels` vouches.
    let module = unsafe { context.device.create_shader_module(&module_info, None) }
        .map_err(failed(stage, "vkCreateShaderModule"))?;
    let entries: Vec<_> = (0..)
        .zip(spec)
        .map(|(i, &(id, _))| vk::SpecializationMapEntry::default().constant_id(id).offset(4 * i).size(4))
        .collect();
    let values: Vec<u32> = spec.iter().map(|&(_, value)| value).collect();
    let specialization = vk::SpecializationInfo::default().map_entries(&entries).data(bytemuck::cast_slice(&values));
    let info = vk::ComputePipelineCreateInfo::default()
        .layout(layout)
        .flags(match context.executables {
            Some(_) => vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR,
            None => vk::PipelineCreateFlags::empty(),
        })
        .stage(
            vk::PipelineShaderStageCreateInfo::default()
                .stage(vk::ShaderStageFlags::COMPUTE)
                .module(module)
                .name(c"main")
                .specialization_info(&specialization),
        );
    // SAFETY: layout, module and cache are of this device; the table's test compares the layout with
    // the module. The module is not needed once the pipeline exists.
    let created = unsafe {
        let created = context.device.create_compute_pipelines(cache, &[info], None);
        context.device.destroy_shader_module(module, None);
        created
    };
    match created {
        Ok(pipelines) => Ok(pipelines[0]),
        Err((_, result)) => Err(failed(stage, "vkCreateComputePipelines")(result)),
    }
}

/// A statistic that counts something.
fn whole(statistic: &vk::PipelineExecutableStatisticKHR<'_>) -> Option<u64> {
    use vk::PipelineExecutableStatisticFormatKHR as Format;
    // SAFETY: the format says which member of the union the driver wrote.
    unsafe {
        match statistic.format {
            Format::UINT64 => Some(statistic.value.u64),
            Format::INT64 => u64::try_from(statistic.value.i64).ok(),
            _ => None,
        }
    }
}

fn check_limits(context: &Context, kernel: Kernel) -> Result<()> {
    let (needs, limits) = (kernel.interface(), &context.info.limits);
    let texels = needs.texels.len() as u32;
    let checks = [
        ("storage buffers", needs.bindings - texels, limits.storage_buffers),
        ("texel buffers", texels, limits.texel_buffers),
        ("bytes of push constants", needs.push_bytes, limits.push_constants),
        ("invocations a workgroup", needs.local_size, limits.group_invocations),
    ];
    for (what, needed, limit) in checks {
        if needed > limit {
            return Err(Error::device(
                format!("compile {}", kernel.name()),
                format!("it needs {needed} {what}, the device allows {limit}"),
                "choose another device (--device)",
            ));
        }
    }
    Ok(())
}

impl Drop for Compiled {
    fn drop(&mut self) {
        // SAFETY: recorders hold what they use, so no command refers to these any more; destroying a
        // null handle does nothing.
        unsafe {
            self.context.device.destroy_pipeline(self.raw, None);
            self.context.device.destroy_pipeline_layout(self.layout, None);
            self.context.device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::vulkan::{Kernel, gpu};

    #[test]
    fn pipelines_are_compiled_once_for_each_specialization() {
        let Some(gpu) = gpu::for_test(false) else { return };
        let raw = |spec: &[(u32, u32)]| gpu.pipeline(Kernel::ProbeLoop, spec).unwrap().0.raw;
        assert_eq!(raw(&[]), raw(&[]));
        // The kernel has no constant 7: Vulkan ignores it.
        assert_eq!(raw(&[(7, 1)]), raw(&[(7, 1)]));
        assert_ne!(raw(&[]), raw(&[(7, 1)]));
    }
}
