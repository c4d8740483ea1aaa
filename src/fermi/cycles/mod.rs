//! Fidelity `cycles`: the launch replayed cycle by cycle.
//!
//! Blocks go to multiprocessors in turn, and the next block to the first that frees a slot. Warps issue in order,
//! each instruction when its registers are there, two schedulers greedy then oldest. Cycles in which nothing can
//! happen are skipped.

mod crossbar;
mod dram;
mod memory;
mod sm;

use memory::Memory;
use sm::{Caches, Program, Sm};

use super::kernel::Kernel;
use super::launch::Launch;
use super::machine::Machine;
use super::occupancy::launchable;
use super::result::{Counts, CpiStack, Instructions, Latency, Part};
use super::simt::{LANES, Layout, Warp};
use super::times::ADDRESS;
use crate::Result;

/// Replays `launches`, one after the other; memory and L2 keep what they have.
///
/// # Errors
/// [`crate::Error::Usage`] if no block fits a multiprocessor.
pub fn replay(machine: &Machine, launches: &[Launch]) -> Result<Vec<Part>> {
    replay_launches(machine, launches, false)
}

/// As [`replay`], without skipping the cycles in which nothing can happen: to test that it changes nothing.
#[cfg(test)]
pub(super) fn replay_every_cycle(machine: &Machine, launches: &[Launch]) -> Result<Vec<Part>> {
    replay_launches(machine, launches, true)
}

fn replay_launches(machine: &Machine, launches: &[Launch], every_cycle: bool) -> Result<Vec<Part>> {
    let mut memory = Memory::new(machine);
    let mut now = 0;
    let mut parts = Vec::with_capacity(launches.len());
    for launch in launches {
        let begin = now;
        let l2 = memory.counts();
        let mut replay = Replay { every_cycle, ..Replay::new(machine, launch, &mut memory, begin)? };
        now = replay.run(begin);
        parts.push(replay.part(now - begin, l2)?);
    }
    Ok(parts)
}

struct Replay<'a> {
    machine: &'a Machine,
    launch: &'a Launch<'a>,
    program: Program,
    layout: Layout,
    sms: Vec<Sm<'a>>,
    memory: &'a mut Memory,
    /// Blocks of the launch, and how many have started.
    blocks: usize,
    started: usize,
    /// Multiprocessor that took a block last.
    last: usize,
    /// Step through every cycle.
    every_cycle: bool,
}

impl<'a> Replay<'a> {
    fn new(machine: &'a Machine, launch: &'a Launch<'a>, memory: &'a mut Memory, now: u64) -> Result<Replay<'a>> {
        let kernel: &Kernel = launch.kernel;
        let (code, starts) = kernel.code();
        let timing = code.iter().map(|instruction| machine.timing(instruction.operation)).collect();
        let warps_a_block = launch.block_threads().div_ceil(LANES);
        let slots = launch.slots(launchable(machine, launch)?.blocks);
        let resident = (slots * warps_a_block * LANES) as u64 * u64::from(machine.sms);
        let layout = Layout::new(&launch.workload, resident).requests_of(machine.l1.request);
        let caches = Caches { launch, layout };
        let sm = |id| Sm::new(id, machine, (slots, warps_a_block), caches, now);
        Ok(Replay {
            machine,
            launch,
            program: Program { code, timing, starts, registers: kernel.names + 1 },
            layout,
            sms: (0..machine.sms as usize).map(sm).collect(),
            memory,
            blocks: launch.blocks(),
            started: 0,
            last: 0,
            every_cycle: false,
        })
    }

    fn run(&mut self, begin: u64) -> u64 {
        let mut now = begin;
        let mut room = true;
        loop {
            now += 1;
            if room {
                room = self.dispatch(now);
            }
            for at in 0..self.sms.len() {
                if self.every_cycle || self.sms[at].due(self.memory, now) {
                    room |= self.sms[at].step(self.machine, &self.program, self.memory, now);
                }
            }
            self.memory.step(now);
            if self.started == self.blocks && self.sms.iter().all(Sm::empty) {
                break;
            }
            if !self.every_cycle && !room && self.memory.idle() {
                let next = self.sms.iter().map(Sm::next).min().unwrap_or(now);
                let skipped = next.saturating_sub(now + 1);
                self.memory.skip(skipped);
                now += skipped;
            }
        }
        self.sms.iter_mut().for_each(|sm| sm.settle(now + 1));
        now
    }

    /// Gives one block to each multiprocessor with a free slot, in turn. Returns whether more could follow.
    fn dispatch(&mut self, now: u64) -> bool {
        let count = self.sms.len();
        let mut given = false;
        let first = self.last;
        for k in 1..=count {
            let at = (first + k) % count;
            if self.started == self.blocks {
                return false;
            }
            let Some(slot) = self.sms[at].free_block() else { continue };
            let warps = self.block(self.started, at, slot);
            self.sms[at].launch(self.machine, slot, warps, &self.program, now);
            self.started += 1;
            self.last = at;
            given = true;
        }
        given
    }

    /// Warps of block `number`. Threads of a block have their stacks side by side, then those of the same slot
    /// on the next multiprocessor.
    fn block(&self, number: usize, sm: usize, slot: usize) -> Vec<Warp<'a>> {
        let threads = self.launch.block_threads().next_multiple_of(LANES);
        let first = (threads * (sm + self.sms.len() * slot)) as u64;
        (0..self.launch.warps_of(number))
            .map(|warp| Warp::new(self.launch, self.layout, number, warp, first + (warp * LANES) as u64))
            .collect()
    }

    /// What the launch cost, where the L2 had counted `before`.
    fn part(&self, cycles: u64, before: Counts) -> Result<Part> {
        let mut l1 = Counts::default();
        let mut instructions = Instructions::default();
        let mut cpi = CpiStack::default();
        let (mut visits, mut latency) = (0, (0, 0));
        let share = 1.0 / self.sms.len() as f64;
        for sm in &self.sms {
            l1.add(sm.counts);
            instructions.add(&sm.instructions);
            cpi.add_scaled(&sm.cpi, share);
            visits += sm.visits;
            latency = (latency.0 + sm.latency.0, latency.1 + sm.latency.1);
        }
        let memory = latency.0 as f64 / latency.1.max(1) as f64;
        Ok(Part {
            stage: self.launch.stage,
            cycles: cycles as f64,
            instructions,
            visits,
            l1,
            l2: self.memory.counts().since(before),
            latency: Latency { memory, mean: self.machine.sm.load_pipeline as f64 + ADDRESS + l1.miss_rate() * memory },
            occupancy: launchable(self.machine, self.launch)?,
            cpi,
        })
    }
}
