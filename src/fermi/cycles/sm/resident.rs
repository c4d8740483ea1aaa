//! A warp on a multiprocessor.

use super::{NEVER, Program};
use crate::fermi::kernel::Block;
use crate::fermi::simt::{Batch, Segment, Warp};

/// A resident warp.
#[derive(Debug)]
pub(super) struct Resident<'a> {
    pub(super) run: Warp<'a>,
    pub(super) batch: Batch,
    /// Segment of the batch that runs.
    pub(super) segment: usize,
    /// Next instruction, and the end of its block.
    pub(super) pc: usize,
    pub(super) end: usize,
    /// Next memory instruction of the batch.
    pub(super) memory: usize,
    pub(super) lanes: u8,
    /// Cycle from which each register can be read.
    pub(super) ready: Vec<u64>,
    /// Instructions fetched, and when they can issue.
    pub(super) fetched: u32,
    pub(super) fetch_ready: u64,
    /// Stores not yet acknowledged.
    pub(super) stores: u32,
    pub(super) exited: bool,
    pub(super) block: usize,
}

impl Resident<'_> {
    /// Moves to the first segment of a new batch.
    pub(super) fn enter(&mut self, program: &Program) {
        self.segment = 0;
        self.memory = 0;
        self.start(program);
    }

    pub(super) fn start(&mut self, program: &Program) -> Option<Block> {
        let &Segment { block, lanes, .. } = self.batch.segments.get(self.segment)?;
        self.lanes = lanes;
        self.pc = program.starts[block as usize] as usize;
        self.end = program.starts[block as usize + 1] as usize;
        Some(block)
    }

    /// Moves to the next segment and returns its block, none if the warp has ended.
    pub(super) fn segments_next(&mut self, program: &Program) -> Option<Block> {
        self.segment += 1;
        if self.segment == self.batch.segments.len() {
            self.run.advance(&mut self.batch);
            self.segment = 0;
            self.memory = 0;
        }
        self.start(program)
    }

    /// First cycle in which the next instruction can issue, [`NEVER`] while it waits for a load.
    pub(super) fn next_issue(&self, program: &Program) -> u64 {
        if self.exited {
            return NEVER;
        }
        let instruction = &program.code[self.pc];
        let read = instruction.sources.iter().map(|&register| self.ready[usize::from(register)]).max().unwrap_or(0);
        let written = self.ready[usize::from(instruction.destination)];
        read.max(written).max(self.fetch_ready)
    }
}
