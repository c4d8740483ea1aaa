//! What blocks of threads did, one by one and together.

use crate::fermi::result::{Counts, Instructions};
use crate::fermi::times::Load;

/// What a block of threads did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Span {
    /// Cycles from its launch to its end.
    pub cycles: f64,
    /// Accesses of the L1 by its warps.
    pub l1: Counts,
    /// Accesses of the L2 that followed.
    pub l2: Counts,
    /// Those of them for lines of the tree and of stacks, where they are told apart.
    pub reused: Counts,
    /// Instructions of its warps.
    pub instructions: Instructions,
    /// Node and leaf visits of its warps.
    pub visits: u64,
    /// Cycles that its warps spent in arithmetic, summed.
    pub compute: f64,
    /// Cycles that its warps spent in waiting for loads and for issue, summed.
    pub memory: f64,
}

impl Span {
    /// What blocks did together.
    pub fn total(spans: &[Span]) -> Span {
        let mut total = Span::default();
        spans.iter().for_each(|span| total.add(span, 1.0));
        total
    }

    /// Adds `times` what another block did.
    pub fn add(&mut self, other: &Span, times: f64) {
        let scaled = |n: u64| (n as f64 * times).round() as u64;
        self.cycles += other.cycles * times;
        self.l1.add(other.l1.times(times));
        self.l2.add(other.l2.times(times));
        self.reused.add(other.reused.times(times));
        self.instructions.warp += scaled(other.instructions.warp);
        self.instructions.thread += scaled(other.instructions.thread);
        self.visits += scaled(other.visits);
        self.compute += other.compute * times;
        self.memory += other.memory * times;
    }
}

/// What a pass finds.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Of the launch.
    pub cycles: f64,
    /// Mean cycles for which a multiprocessor is at work.
    pub busy_cycles: f64,
    /// All blocks together.
    pub total: Span,
    /// Each block.
    pub spans: Vec<Span>,
}

impl Outcome {
    /// The traffic.
    pub fn load(&self) -> Load {
        let warps_in_flight = (self.total.compute + self.total.memory) / self.busy_cycles.max(1.0);
        Load { warps_in_flight, busy_cycles: self.busy_cycles, l2: self.total.l2 }
    }
}
