//! The queues of strategy `migrate` on the device: a stable counting sort of the active entries by subtree, and
//! each SM's share of the result.

use super::stream::Stream;
use crate::Result;
use crate::bvh::Partition;
use crate::layout::{Batch, QueueEntry, QueuePush, Round};
use crate::shared::*;
use crate::vulkan::{Buffer, DeviceKind, Gpu, Kernel, Pipeline, Place};

/// Stage of these kernels in reports of time.
const STAGE: &str = "queues";

/// Byte offsets of the arguments of indirect dispatches in a [`Batch`].
const TILES_OFFSET: u64 = std::mem::offset_of!(Batch, tiles) as u64;
const SMS_OFFSET: u64 = std::mem::offset_of!(Batch, sms) as u64;

/// Digits of a subtree's index, by which queues are sorted in as many passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Digits {
    /// Passes, which is digits of an index.
    pub passes: u32,
    /// Bits of a digit.
    bits: u32,
}

impl Digits {
    /// As few and as small as tell so many subtrees apart, with no fewer values than a warp has lanes.
    pub fn of(subtrees: usize) -> Digits {
        let bits = subtrees.next_power_of_two().ilog2().max(WARP.ilog2());
        let passes = bits.div_ceil(MOST_DIGIT_BITS);
        Digits { passes, bits: bits.div_ceil(passes) }
    }

    /// Values of a digit.
    pub fn values(self) -> u32 {
        1 << self.bits
    }

    /// Bits of an index below the digit of a pass.
    pub fn shift(self, pass: u32) -> u32 {
        pass * self.bits
    }
}

/// Queues for a number of rays. Entries go back and forth between two buffers; which of them, and which of the
/// two batches, is current is told by a parity of 0 or 1.
pub struct Queues {
    entries: [Buffer; 2],
    counts: Buffer,
    /// Two [`Batch`].
    pub batches: Buffer,
    /// [`Round`] 0 is scheduling's.
    pub rounds: Buffer,
    /// Where each SM's entries begin, and where the last one's end.
    pub shares: Buffer,
    first_of_sm: Buffer,
    sms: u32,
    digits: Digits,
    /// Specialization constant of the kernels that divide entries among invocations.
    pub least_strip: (u32, u32),
    kernels: Kernels,
}

struct Kernels {
    count: Pipeline,
    prefix: Pipeline,
    scatter: Pipeline,
    shares: Pipeline,
}

impl Queues {
    /// Bytes of the entries of so many rays.
    pub fn bytes(most_rays: u32) -> u64 {
        2 * u64::from(most_rays) * size_of::<QueueEntry>() as u64
    }

    /// Makes room for `most_rays` rays and `rounds` rounds a submission: a ray is in at most one queue, so that
    /// none can overflow.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if memory is short or the driver fails.
    pub fn new(gpu: &Gpu, partition: &Partition, most_rays: u32, rounds: u32) -> Result<Queues> {
        let buffer = |label: &str, bytes: u64| gpu.buffer(label, bytes, Place::Device);
        let half = Queues::bytes(most_rays) / 2;
        let digits = Digits::of(partition.subtrees.len());
        // An invocation of a software driver, which runs few at a time, goes through as many as the counts that it clears.
        let least_strip = if gpu.info().kind == DeviceKind::Cpu { digits.values() } else { LEAST_STRIP };
        let least_strip = (SPEC_LEAST_STRIP, least_strip);
        Ok(Queues {
            entries: [buffer("queues", half)?, buffer("sorted queues", half)?],
            counts: buffer("queue counts", u64::from(digits.values() * MOST_TILES) * 4)?,
            batches: buffer("batches", 2 * size_of::<Batch>() as u64)?,
            rounds: buffer("rounds", u64::from(1 + rounds) * size_of::<Round>() as u64)?,
            shares: buffer("shares", u64::from(partition.sms() + 1) * 4)?,
            first_of_sm: gpu.upload("first subtrees", &partition.first_of_sm)?,
            sms: partition.sms(),
            digits,
            least_strip,
            kernels: Kernels {
                count: gpu.pipeline(Kernel::QueueCount, &[])?,
                prefix: gpu.pipeline(Kernel::QueuePrefix, &[least_strip])?,
                scatter: gpu.pipeline(Kernel::QueueScatter, &[])?,
                shares: gpu.pipeline(Kernel::QueueShares, &[])?,
            },
        })
    }

    /// The entries.
    pub fn entries(&self, parity: u32) -> &Buffer {
        &self.entries[parity as usize]
    }

    /// Where a dispatch of one workgroup an SM finds its number of workgroups: none if no ray is active.
    pub fn sm_groups(&self, parity: u32) -> (&Buffer, u64) {
        (&self.batches, batch_offset(parity) + SMS_OFFSET)
    }

    /// Records the sort of the entries at `parity`, those of ended rays left out, and each SM's share; returns
    /// the parity at which they are sorted.
    ///
    /// # Errors
    /// As [`Stream::dispatch`].
    pub fn sort(&self, stream: &mut Stream, round: u32, parity: u32) -> Result<u32> {
        let mut push = QueuePush { parity, shift: 0, round, sms: self.sms, digits: self.digits.values() };
        for pass in 0..self.digits.passes {
            push.shift = self.digits.shift(pass);
            self.pass(stream, push)?;
            push.parity = 1 - push.parity;
        }
        let sorted = [self.entries(push.parity), &self.batches, &self.first_of_sm, &self.shares];
        stream.dispatch(STAGE, &self.kernels.shares, (&sorted, &[]), &push, self.sms + 1)?;
        Ok(push.parity)
    }

    fn pass(&self, stream: &mut Stream, push: QueuePush) -> Result<()> {
        let Queues { counts, batches, rounds, kernels, .. } = self;
        let (from, to) = (self.entries(push.parity), self.entries(1 - push.parity));
        let tiles = (batches, batch_offset(push.parity) + TILES_OFFSET);
        stream.dispatch_indirect(STAGE, &kernels.count, (&[from, counts, batches], &[]), &push, tiles)?;
        stream.dispatch(STAGE, &kernels.prefix, (&[counts, batches, rounds], &[]), &push, 1)?;
        stream.dispatch_indirect(STAGE, &kernels.scatter, (&[from, counts, batches, to], &[]), &push, tiles)
    }
}

fn batch_offset(parity: u32) -> u64 {
    u64::from(parity) * size_of::<Batch>() as u64
}
