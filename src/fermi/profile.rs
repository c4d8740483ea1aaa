//! What each basic block costs a warp that has the multiprocessor to itself.

use super::kernel::{Block, Instruction, Kernel, Operation};
use super::machine::Machine;

/// Cost of one run of a block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Instructions.
    pub instructions: u64,
    /// Cycles from its first issue to that of the next block, if all loads hit the L1.
    pub cycles: u64,
    /// The same, less the cycles that its loads take more than a hit, if these are many.
    pub around_loads: i64,
}

impl Cost {
    /// Cycles if the slowest of the block's loads takes `extra` cycles more than a hit.
    pub fn with(&self, extra: u64) -> u64 {
        self.cycles.max((self.around_loads + extra as i64).max(0) as u64)
    }
}

/// A load so slow that all of a block waits for it.
const SLOW: u64 = 10_000;

/// Costs of all blocks, by number of the block.
pub fn profile(machine: &Machine, kernel: &Kernel) -> [Cost; Block::ALL.len()] {
    Block::ALL.map(|block| {
        let code = kernel.block(block);
        let cycles = duration(machine, kernel, code, 0);
        let loads =
            code.iter().any(|instruction| matches!(instruction.operation, Operation::Load | Operation::Texture));
        let around_loads =
            if loads { duration(machine, kernel, code, SLOW) as i64 - SLOW as i64 } else { i64::MIN / 2 };
        Cost { instructions: code.len() as u64, cycles, around_loads }
    })
}

/// Cycles of in-order issue, each instruction when its registers are there and it is fetched.
fn duration(machine: &Machine, kernel: &Kernel, code: &[Instruction], extra: u64) -> u64 {
    let sm = &machine.sm;
    let mut ready = vec![0u64; kernel.names + 1];
    let (mut now, mut fetched, mut fetch_ready) = (0, sm.fetch, 0);
    for instruction in code {
        let read = instruction.sources.iter().map(|&r| ready[usize::from(r)]).max().unwrap_or(0);
        let issue = read.max(fetch_ready).max(now);
        let latency = match machine.timing(instruction.operation) {
            Some(timing) => sm.pipeline + timing.latency,
            None => machine.load_latency(instruction.operation) + extra,
        };
        ready[usize::from(instruction.destination)] = issue + latency + sm.collect(instruction);
        ready[0] = 0;
        fetched -= 1;
        if fetched == 0 {
            fetched = sm.fetch;
            fetch_ready = issue + sm.fetch_latency;
        }
        now = issue + 1;
    }
    // Most blocks end in a jump: the instruction after it is fetched anew.
    now + sm.fetch_latency
}
