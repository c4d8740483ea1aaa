//! [`Recorder`]: a list of commands, checked as it is written, submitted once.

use std::sync::Arc;
use std::time::Instant;

use ash::vk;

use super::buffer::{Buffer, Memory};
use super::context::Context;
use super::descriptors::Descriptors;
use super::error::failed;
use super::invocations::Invocations;
use super::pipeline::{Compiled, Pipeline};
use super::timestamps::{Timestamps, Timings};
use crate::{Error, Result};

/// How long to wait before the log says that the device is still at work.
const REPORT_SECONDS: u64 = 10;

/// Commands for the device, in order. Commands that depend on each other need a
/// [`Recorder::barrier`] between them.
pub struct Recorder {
    stage: String,
    commands: vk::CommandBuffer,
    pool: vk::CommandPool,
    descriptors: Descriptors,
    timestamps: Timestamps,
    invocations: Option<Invocations>,
    buffers: Vec<Arc<Memory>>,
    pipelines: Vec<Arc<Compiled>>,
    context: Arc<Context>,
}

impl Recorder {
    pub(super) fn new(context: &Arc<Context>, stage: &str) -> Result<Self> {
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(context.queue_family);
        // SAFETY: the device is alive and has this queue family.
        let pool =
            unsafe { context.device.create_command_pool(&info, None) }.map_err(failed(stage, "vkCreateCommandPool"))?;
        // Dropping `recorder` frees the pool.
        let mut recorder = Self {
            stage: stage.to_owned(),
            commands: vk::CommandBuffer::null(),
            pool,
            descriptors: Descriptors::new(context),
            timestamps: Timestamps::new(context),
            invocations: None,
            buffers: Vec::new(),
            pipelines: Vec::new(),
            context: context.clone(),
        };
        let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
        // SAFETY: the pool is fresh and used by this thread alone.
        recorder.commands = unsafe { context.device.allocate_command_buffers(&info) }
            .map_err(failed(stage, "vkAllocateCommandBuffers"))?[0];
        let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the command buffer is fresh.
        unsafe { context.device.begin_command_buffer(recorder.commands, &info) }
            .map_err(failed(stage, "vkBeginCommandBuffer"))?;
        Ok(recorder)
    }

    /// Runs `groups` workgroups of the kernel with `buffers` at bindings 0, 1, ... and `push` as push
    /// constants. No groups: nothing.
    ///
    /// # Errors
    /// [`Error::Check`] when `buffers` or `push` are not what the kernel takes; [`Error::Device`] when
    /// a buffer is larger than a binding may be, or `groups` more than the device takes.
    pub fn dispatch(&mut self, pipeline: &Pipeline, buffers: &[&Buffer], push: &[u8], groups: u32) -> Result<()> {
        let limit = self.context.info.limits.groups;
        if groups > limit {
            return Err(Error::device(
                &self.stage,
                format!("{groups} workgroups of {} are more than the device takes ({limit})", pipeline.kernel().name()),
                "use a smaller image",
            ));
        }
        self.bind(pipeline, buffers, push)?;
        // SAFETY: recording; pipeline, descriptors and push constants are bound; groups are in range.
        unsafe { self.context.device.cmd_dispatch(self.commands, groups, 1, 1) };
        Ok(())
    }

    /// As [`Recorder::dispatch`], with the three group counts read from `counts` at byte `offset` when
    /// the device gets there. Counts beyond the limit ([`super::Limits::groups`]) are the kernel's fault that wrote them.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`]; [`Error::Check`] when no three counts lie at `offset`.
    pub fn dispatch_indirect(
        &mut self,
        pipeline: &Pipeline,
        buffers: &[&Buffer],
        push: &[u8],
        counts: &Buffer,
        offset: u64,
    ) -> Result<()> {
        if !offset.is_multiple_of(4) {
            return Err(Error::Check(format!("group counts at {offset} of {}: not a multiple of 4", counts.label())));
        }
        self.within(counts, offset, 12)?;
        self.bind(pipeline, buffers, push)?;
        self.keep(counts);
        // SAFETY: recording; everything is bound; the counts lie within the buffer, aligned.
        unsafe { self.context.device.cmd_dispatch_indirect(self.commands, counts.0.raw, offset) };
        Ok(())
    }

    /// What was written before is seen by what comes after, on the device.
    pub fn barrier(&mut self) {
        use vk::{AccessFlags as Access, PipelineStageFlags as Stage};
        self.dependency(
            (Stage::COMPUTE_SHADER | Stage::TRANSFER, Access::SHADER_WRITE | Access::TRANSFER_WRITE),
            (
                Stage::COMPUTE_SHADER | Stage::TRANSFER | Stage::DRAW_INDIRECT,
                Access::SHADER_READ
                    | Access::SHADER_WRITE
                    | Access::TRANSFER_READ
                    | Access::TRANSFER_WRITE
                    | Access::INDIRECT_COMMAND_READ,
            ),
        );
    }

    /// Sets every 32-bit word of `buffer`.
    pub fn fill(&mut self, buffer: &Buffer, value: u32) -> Result<()> {
        self.within(buffer, 0, buffer.bytes())?;
        self.keep(buffer);
        // SAFETY: recording; sizes of buffers are multiples of 4.
        unsafe { self.context.device.cmd_fill_buffer(self.commands, buffer.0.raw, 0, vk::WHOLE_SIZE, value) };
        Ok(())
    }

    /// Copies `bytes` bytes between two buffers.
    ///
    /// # Errors
    /// [`Error::Check`] when either range is outside its buffer or both are of the same buffer.
    pub fn copy(&mut self, from: &Buffer, from_offset: u64, to: &Buffer, to_offset: u64, bytes: u64) -> Result<()> {
        self.within(from, from_offset, bytes)?;
        self.within(to, to_offset, bytes)?;
        if Arc::ptr_eq(&from.0, &to.0) {
            return Err(Error::Check(format!("copy of {} to itself", from.label())));
        }
        if bytes == 0 {
            return Ok(());
        }
        self.keep(from);
        self.keep(to);
        let region = vk::BufferCopy { src_offset: from_offset, dst_offset: to_offset, size: bytes };
        // SAFETY: recording; both ranges are within their buffers and do not overlap.
        unsafe { self.context.device.cmd_copy_buffer(self.commands, from.0.raw, to.0.raw, &[region]) };
        Ok(())
    }

    /// Begins a span of [`Timings`], which lasts until the next timestamp or the end.
    pub fn timestamp(&mut self, label: &str) -> Result<()> {
        self.timestamps.write(self.commands, label).map_err(failed(&self.stage, "vkCreateQueryPool"))
    }

    /// From here on the driver counts invocations of kernels, where it can; see [`Timings`].
    ///
    /// # Errors
    /// [`Error::Device`] if the driver fails.
    pub fn count_invocations(&mut self) -> Result<()> {
        if self.invocations.is_none() {
            self.invocations =
                Invocations::begin(&self.context, self.commands).map_err(failed(&self.stage, "vkCreateQueryPool"))?;
        }
        Ok(())
    }

    /// Keeps alive, until the commands are done, a buffer that kernels reach by its address.
    pub fn keep(&mut self, buffer: &Buffer) {
        self.buffers.push(buffer.0.clone());
    }

    /// Runs the commands and waits for their end.
    ///
    /// # Errors
    /// [`Error::Device`] naming the stage when the device is lost or out of memory.
    pub fn submit(mut self) -> Result<Timings> {
        use vk::{AccessFlags as Access, PipelineStageFlags as Stage};
        if !self.timestamps.is_empty() {
            self.timestamp("")?;
        }
        if let Some(invocations) = &self.invocations {
            invocations.end(self.commands);
        }
        self.dependency(
            (Stage::COMPUTE_SHADER | Stage::TRANSFER, Access::SHADER_WRITE | Access::TRANSFER_WRITE),
            (Stage::HOST, Access::HOST_READ),
        );
        let start = Instant::now();
        self.run()?;
        let wall = start.elapsed().as_secs_f64();
        let unread = || failed(&self.stage, "vkGetQueryPoolResults");
        let spans = self.timestamps.read().map_err(unread())?;
        let invocations = self.invocations.as_ref().map(Invocations::read).transpose().map_err(unread())?;
        Ok(Timings { spans, wall, invocations })
    }

    fn run(&self) -> Result<()> {
        let device = &self.context.device;
        // SAFETY: recording, outside of everything that must be closed first.
        unsafe { device.end_command_buffer(self.commands) }.map_err(failed(&self.stage, "vkEndCommandBuffer"))?;
        // SAFETY: the device is alive.
        let fence = unsafe { device.create_fence(&vk::FenceCreateInfo::default(), None) }
            .map_err(failed(&self.stage, "vkCreateFence"))?;
        let commands = [self.commands];
        let submit = [vk::SubmitInfo::default().command_buffers(&commands)];
        let queue = self.context.queue();
        // SAFETY: the queue is held; the commands are complete, and everything they use is kept alive
        // by `self`, which outlives the wait.
        let result = match unsafe { device.queue_submit(*queue, &submit, fence) } {
            Ok(()) => self.wait(fence),
            Err(result) => Err(failed(&self.stage, "vkQueueSubmit")(result)),
        };
        if result.is_err() {
            // SAFETY: the queue is held. A wait that failed may have left commands running, and what
            // they use is about to be freed; a device that is lost returns at once.
            let _ = unsafe { device.queue_wait_idle(*queue) };
        }
        // SAFETY: nothing waits for the fence any more.
        unsafe { device.destroy_fence(fence, None) };
        result
    }

    fn wait(&self, fence: vk::Fence) -> Result<()> {
        loop {
            // SAFETY: the fence is of this device.
            match unsafe { self.context.device.wait_for_fences(&[fence], true, REPORT_SECONDS * 1_000_000_000) } {
                Err(vk::Result::TIMEOUT) => tracing::warn!("{}: the device is still at work", self.stage),
                result => return result.map_err(failed(&self.stage, "vkWaitForFences")),
            }
        }
    }

    fn bind(&mut self, pipeline: &Pipeline, buffers: &[&Buffer], push: &[u8]) -> Result<()> {
        let kernel = pipeline.kernel();
        let (name, takes) = (kernel.name(), kernel.interface());
        let bindings = takes.bindings;
        if buffers.len() != bindings as usize {
            return Err(Error::Check(format!("{name} takes {bindings} buffers, not {}", buffers.len())));
        }
        if push.len() != takes.push_bytes as usize {
            return Err(Error::Check(format!(
                "{name} takes {} bytes of push constants, not {}",
                takes.push_bytes,
                push.len()
            )));
        }
        if !Arc::ptr_eq(&pipeline.0.context, &self.context) {
            return Err(Error::Check(format!("{name} was compiled for another device")));
        }
        let limits = &self.context.info.limits;
        for (binding, buffer) in (0..).zip(buffers) {
            self.within(buffer, 0, buffer.bytes())?;
            let range = match takes.texels.contains(&binding) {
                true => limits.texel_buffer_range,
                false => limits.storage_buffer_range,
            };
            if buffer.bytes() > range {
                return Err(Error::device(
                    &self.stage,
                    format!(
                        "the buffer {} ({} bytes) is larger than the device lets a kernel bind ({range} bytes)",
                        buffer.label(),
                        buffer.bytes()
                    ),
                    "use a smaller scene or image, or another device (--device)",
                ));
            }
        }

        let set =
            self.descriptors.set(&pipeline.0, buffers).map_err(failed(&self.stage, "vkAllocateDescriptorSets"))?;
        let (device, compute) = (&self.context.device, vk::PipelineBindPoint::COMPUTE);
        // SAFETY: recording; set and push constants match the pipeline's layout, as checked above.
        unsafe {
            device.cmd_bind_pipeline(self.commands, compute, pipeline.0.raw);
            device.cmd_bind_descriptor_sets(self.commands, compute, pipeline.0.layout, 0, &[set], &[]);
            if !push.is_empty() {
                let stages = vk::ShaderStageFlags::COMPUTE;
                device.cmd_push_constants(self.commands, pipeline.0.layout, stages, 0, push);
            }
        }
        self.pipelines.push(pipeline.0.clone());
        self.buffers.extend(buffers.iter().map(|buffer| buffer.0.clone()));
        Ok(())
    }

    /// `bytes` bytes from `offset` on lie within the buffer, and it is of this device.
    fn within(&self, buffer: &Buffer, offset: u64, bytes: u64) -> Result<()> {
        if !Arc::ptr_eq(&buffer.0.context, &self.context) {
            return Err(Error::Check(format!("the buffer {} is of another device", buffer.label())));
        }
        if offset.checked_add(bytes).is_none_or(|end| end > buffer.bytes()) {
            return Err(Error::Check(format!(
                "{bytes} bytes at {offset} are outside the buffer {} ({} bytes)",
                buffer.label(),
                buffer.bytes()
            )));
        }
        Ok(())
    }

    fn dependency(
        &self,
        (from, written): (vk::PipelineStageFlags, vk::AccessFlags),
        (to, read): (vk::PipelineStageFlags, vk::AccessFlags),
    ) {
        let barrier = [vk::MemoryBarrier::default().src_access_mask(written).dst_access_mask(read)];
        // SAFETY: recording; the stages exist on every compute queue.
        unsafe {
            let none = vk::DependencyFlags::empty();
            self.context.device.cmd_pipeline_barrier(self.commands, from, to, none, &barrier, &[], &[]);
        }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        // SAFETY: the commands were never submitted, or are done: `run` waits even when it fails.
        unsafe { self.context.device.destroy_command_pool(self.pool, None) };
    }
}
