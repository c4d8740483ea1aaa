//! Segments of a warp's run and their accesses.

use crate::fermi::kernel::Block;
use crate::fermi::machine::LINE;

/// Direction and space of a memory instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Load from global memory.
    Load,
    /// Store to global memory.
    Store,
    /// Load by the texture units.
    Texture,
    /// Load from local memory: the stack.
    Pop,
    /// Store to local memory.
    Push,
}

impl Access {
    /// Whether it writes.
    pub fn writes(self) -> bool {
        matches!(self, Access::Store | Access::Push)
    }
}

/// A memory instruction of a segment: lines `lines.0..lines.1` of the batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryOp {
    /// What it does.
    pub access: Access,
    /// Its lines, in the batch.
    pub lines: (u32, u32),
    /// Bytes it wants of a line at most, a multiple of 32.
    pub bytes: u8,
    /// Bytes that all its lanes together read or write.
    pub moved: u16,
}

/// A basic block run once by some lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// The block.
    pub block: Block,
    /// Lanes that run it.
    pub lanes: u8,
    /// Its memory instructions, in the batch.
    pub memory: (u16, u16),
}

/// Segments that follow each other without a decision in between, and their accesses.
#[derive(Clone, Debug, Default)]
pub struct Batch {
    /// In order.
    pub segments: Vec<Segment>,
    /// Memory instructions of all segments, in order.
    pub memory: Vec<MemoryOp>,
    /// Line numbers (address / 128), in the order in which they are accessed.
    pub lines: Vec<u64>,
    /// Lanes of the last segment, a mask.
    lanes: u32,
    /// Bytes of the words that lanes side by side ask for in one request.
    request: u64,
    /// Whether memory instructions are left out.
    blocks_alone: bool,
}

impl Batch {
    /// For the segments alone: no address is computed.
    pub fn without_lines() -> Batch {
        Batch { blocks_alone: true, ..Batch::default() }
    }

    pub(super) fn clear(&mut self, request: u64) {
        self.request = request;
        self.segments.clear();
        self.memory.clear();
        self.lines.clear();
    }

    /// Begins a segment of `lanes`, a mask.
    pub(super) fn segment(&mut self, block: Block, lanes: u32) {
        self.lanes = lanes;
        let memory = self.memory.len() as u16;
        self.segments.push(Segment { block, lanes: lanes.count_ones() as u8, memory: (memory, memory) });
    }

    /// Adds a memory instruction of `size` bytes a lane to the last segment, whose lanes have `addresses` in order. Lanes
    /// side by side make a request, and a request is one access a distinct line, the highest first.
    pub(super) fn access(&mut self, access: Access, addresses: impl Iterator<Item = u64>, size: u64) {
        if self.blocks_alone {
            return;
        }
        let start = self.lines.len();
        let (mut first, mut request) = (start, 0);
        let (mut low, mut high, mut moved) = (LINE, 0, 0);
        for (lane, address) in bits(self.lanes).zip(addresses) {
            let of = if access == Access::Texture { 0 } else { lane as u64 * size / self.request };
            if of != request {
                self.lines[first..].sort_unstable_by(|a, b| b.cmp(a));
                (first, request) = (self.lines.len(), of);
            }
            let line = address / LINE;
            low = low.min(address % LINE);
            high = high.max(address % LINE + size);
            moved += size as u16;
            // Lines of one request are few and often the same as the last.
            if self.lines.last().filter(|_| self.lines.len() > first) != Some(&line)
                && !self.lines[first..].contains(&line)
            {
                self.lines.push(line);
            }
        }
        self.lines[first..].sort_unstable_by(|a, b| b.cmp(a));
        // Half and quarter lines go as such (compute capability 1.3's rule, which the simulator keeps).
        let bytes = match (low / 32, high.saturating_sub(1) / 32) {
            (a, b) if a == b => 32,
            (a, b) if a / 2 == b / 2 => 64,
            _ => 128,
        };
        self.push(MemoryOp { access, lines: (start as u32, self.lines.len() as u32), bytes, moved });
    }

    /// Adds the last memory instruction `times` more: to other words of the same lines.
    pub(super) fn again(&mut self, times: usize) {
        if let Some(&op) = self.memory.last() {
            (0..times).for_each(|_| self.push(op));
        }
    }

    fn push(&mut self, op: MemoryOp) {
        self.memory.push(op);
        if let Some(segment) = self.segments.last_mut() {
            segment.memory.1 += 1;
        }
    }
}

/// Indices of the bits set.
pub(super) fn bits(mut mask: u32) -> impl Iterator<Item = usize> + Clone {
    std::iter::from_fn(move || {
        let bit = mask.trailing_zeros() as usize;
        mask &= mask.wrapping_sub(1);
        (bit < super::LANES).then_some(bit)
    })
}
