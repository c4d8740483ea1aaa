//! What each block of a launch costs alone, without caches.

use rayon::prelude::*;

use crate::fermi::launch::Launch;
use crate::fermi::machine::Machine;
use crate::fermi::profile::profile;
use crate::fermi::result::Instructions;
use crate::fermi::simt::{Batch, Layout, Warp};

/// What one block does, exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Block {
    /// Cycles of its dearest warp if all loads hit the L1: a block stays as long as its last warp.
    pub(super) alone: f64,
    /// Nodes and leaves that its rays visit: lanes visit together, but mostly each its own lines.
    pub(super) steps: f64,
    /// Instructions of its warps.
    pub(super) instructions: Instructions,
    /// Node and leaf visits of its warps.
    pub(super) visits: u64,
    /// Cycles of all its warps together.
    pub(super) compute: f64,
}

impl Block {
    /// What its cycles are regressed on.
    pub(super) fn known(&self) -> [f64; KNOWN] {
        [self.alone, self.steps]
    }
}

/// Numbers of [`Block::known`].
pub(super) const KNOWN: usize = 2;

/// All blocks of a launch. Which basic blocks a warp runs follows from its rays' steps alone, so this takes a small part
/// of a replay's time, and a replay departs from it by a factor that differs little from place to place.
pub(super) fn of(machine: &Machine, launch: &Launch) -> Vec<Block> {
    let costs = profile(machine, launch.kernel);
    let layout = Layout::new(&launch.workload, 0);
    let block = |number: usize| {
        let mut block = Block::default();
        let mut batch = Batch::without_lines();
        for warp in 0..launch.warps_of(number) {
            let mut warp = Warp::new(launch, layout, number, warp, 0);
            let mut cycles = 0;
            loop {
                warp.advance(&mut batch);
                if batch.segments.is_empty() {
                    break;
                }
                for segment in &batch.segments {
                    let cost = costs[segment.block as usize];
                    cycles += cost.cycles;
                    block.instructions.issue(cost.instructions, segment.lanes);
                    block.visits += u64::from(segment.block.visits());
                    block.steps += if segment.block.visits() { f64::from(segment.lanes) } else { 0.0 };
                }
            }
            block.alone = block.alone.max(cycles as f64);
            block.compute += cycles as f64;
        }
        block
    };
    (0..launch.blocks()).into_par_iter().map(block).collect()
}
