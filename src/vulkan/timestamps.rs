//! Time on the device, from timestamp queries.

use std::sync::Arc;

use ash::vk;

use super::context::Context;

/// Queries a pool; a recorder with more takes more pools.
const QUERIES: u32 = 64;

/// How long a recorder's work took.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Timings {
    /// Time on the device between timestamps; empty when the device has none.
    pub spans: Vec<Span>,
    /// Wall time from submission to completion, in seconds.
    pub wall: f64,
    /// Invocations of kernels, where they were to be counted and the device does.
    pub invocations: Option<u64>,
}

/// From one timestamp to the next, or to the end of the recorder.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    /// The label of the timestamp that begins it.
    pub label: String,
    /// Seconds on the device.
    pub seconds: f64,
}

impl Timings {
    /// Seconds of all spans with this label.
    pub fn seconds(&self, label: &str) -> f64 {
        self.spans.iter().filter(|span| span.label == label).map(|span| span.seconds).sum()
    }
}

/// Ticks from one reading of a timer of `bits` valid bits to the next: bits beyond those are undefined, and the timer may
/// have wrapped once.
pub fn ticks_between(begin: u64, end: u64, bits: u32) -> u64 {
    end.wrapping_sub(begin) & (u64::MAX >> (64 - bits.clamp(1, 64)))
}

pub(super) struct Timestamps {
    context: Arc<Context>,
    pools: Vec<vk::QueryPool>,
    labels: Vec<String>,
}

impl Timestamps {
    pub fn new(context: &Arc<Context>) -> Self {
        Self { context: context.clone(), pools: Vec::new(), labels: Vec::new() }
    }

    pub fn is_empty(&self) -> bool {
        self.labels.is_empty()
    }

    /// Records the time at which all earlier commands are done. Nothing on a device without timestamps.
    pub fn write(&mut self, commands: vk::CommandBuffer, label: &str) -> Result<(), vk::Result> {
        if self.context.timestamp_bits == 0 {
            return Ok(());
        }
        let device = &self.context.device;
        let query = self.labels.len() as u32 % QUERIES;
        if query == 0 {
            let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(QUERIES);
            // SAFETY: the device is alive; the queue family has timestamps.
            let pool = unsafe { device.create_query_pool(&info, None) }?;
            self.pools.push(pool);
            // SAFETY: the command buffer is being recorded; the pool lives until it is done.
            unsafe { device.cmd_reset_query_pool(commands, pool, 0, QUERIES) };
        }
        let Some(&pool) = self.pools.last() else { unreachable!("the first query made a pool") };
        // SAFETY: the query was reset and is written once.
        unsafe { device.cmd_write_timestamp(commands, vk::PipelineStageFlags::BOTTOM_OF_PIPE, pool, query) };
        self.labels.push(label.to_owned());
        Ok(())
    }

    /// The spans, after the device is done with the commands.
    pub fn read(&self) -> Result<Vec<Span>, vk::Result> {
        let mut ticks = vec![0u64; self.labels.len()];
        for (&pool, ticks) in self.pools.iter().zip(ticks.chunks_mut(QUERIES as usize)) {
            let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
            // SAFETY: as many queries of this pool were written as `ticks` has places.
            unsafe { self.context.device.get_query_pool_results(pool, 0, ticks, flags) }?;
        }
        let (bits, period) = (self.context.timestamp_bits, self.context.info.limits.timestamp_period);
        let seconds = ticks.windows(2).map(|pair| ticks_between(pair[0], pair[1], bits) as f64 * period);
        Ok(self.labels.iter().cloned().zip(seconds).map(|(label, seconds)| Span { label, seconds }).collect())
    }
}

impl Drop for Timestamps {
    fn drop(&mut self) {
        for &pool in &self.pools {
            // SAFETY: the recorder drops this after its commands are done or never were submitted.
            unsafe { self.context.device.destroy_query_pool(pool, None) };
        }
    }
}
