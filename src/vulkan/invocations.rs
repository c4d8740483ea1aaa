//! Invocations of kernels as the driver counts them: a pipeline statistics query over a recorder's commands.

use std::sync::Arc;

use ash::vk;

use super::context::Context;

pub(super) struct Invocations {
    context: Arc<Context>,
    pool: vk::QueryPool,
}

impl Invocations {
    /// Counts from here on; none on a device without pipeline statistics.
    pub fn begin(context: &Arc<Context>, commands: vk::CommandBuffer) -> Result<Option<Self>, vk::Result> {
        if !context.info.driver_counters.pipeline_statistics {
            return Ok(None);
        }
        let device = &context.device;
        let info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::PIPELINE_STATISTICS)
            .query_count(1)
            .pipeline_statistics(vk::QueryPipelineStatisticFlags::COMPUTE_SHADER_INVOCATIONS);
        // SAFETY: the device is alive and was opened with the feature.
        let pool = unsafe { device.create_query_pool(&info, None) }?;
        // SAFETY: the command buffer is being recorded, on a queue that computes; the pool lives until it is done.
        unsafe {
            device.cmd_reset_query_pool(commands, pool, 0, 1);
            device.cmd_begin_query(commands, pool, 0, vk::QueryControlFlags::empty());
        }
        Ok(Some(Self { context: context.clone(), pool }))
    }

    /// Counts up to here.
    pub fn end(&self, commands: vk::CommandBuffer) {
        // SAFETY: the query was begun in this command buffer and is ended once.
        unsafe { self.context.device.cmd_end_query(commands, self.pool, 0) };
    }

    /// The count, after the device is done with the commands.
    pub fn read(&self) -> Result<u64, vk::Result> {
        let mut count = [0u64];
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        // SAFETY: the query was ended, and has one value.
        unsafe { self.context.device.get_query_pool_results(self.pool, 0, &mut count, flags) }?;
        Ok(count[0])
    }
}

impl Drop for Invocations {
    fn drop(&mut self) {
        // SAFETY: the recorder drops this after its commands are done or never were submitted.
        unsafe { self.context.device.destroy_query_pool(self.pool, None) };
    }
}
