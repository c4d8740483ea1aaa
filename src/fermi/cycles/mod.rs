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
use sm::{Program, Sm};

use super::caches::ADDRESS;
use super::kernel::Kernel;
use super::machine::Machine;
use super::occupancy::{Occupancy, launchable};
use super::result::{Accounting, CacheResult, Counts, CpiStack, Fidelity, Instructions, Latency, Prediction};
use super::simt::{LANES, Layout, Warp, Workload};
use crate::Result;

/// Replays `workload` as `kernel` on `machine`.
///
/// # Errors
/// [`Error::Usage`] if no block fits a multiprocessor.
pub fn replay(machine: &Machine, kernel: &Kernel, workload: &Workload) -> Result<Prediction> {
    let occupancy = launchable(machine, kernel)?;
    let mut launch = Launch::new(machine, kernel, workload, occupancy);
    let cycles = launch.run();
    Ok(launch.prediction(cycles, occupancy))
}

/// As [`replay`], without skipping the cycles in which nothing can happen: to test that it changes nothing.
#[cfg(test)]
pub(super) fn replay_every_cycle(machine: &Machine, kernel: &Kernel, workload: &Workload) -> Result<Prediction> {
    let occupancy = launchable(machine, kernel)?;
    let mut launch = Launch { every_cycle: true, ..Launch::new(machine, kernel, workload, occupancy) };
    let cycles = launch.run();
    Ok(launch.prediction(cycles, occupancy))
}

struct Launch<'a> {
    machine: &'a Machine,
    kernel: &'a Kernel,
    workload: &'a Workload<'a>,
    program: Program,
    layout: Layout,
    sms: Vec<Sm<'a>>,
    memory: Memory,
    /// Blocks of the launch, and how many have started.
    blocks: usize,
    started: usize,
    /// Multiprocessor that took a block last.
    last: usize,
    warps_a_block: usize,
    /// Step through every cycle.
    every_cycle: bool,
}

impl<'a> Launch<'a> {
    fn new(machine: &'a Machine, kernel: &'a Kernel, workload: &'a Workload<'a>, occupancy: Occupancy) -> Launch<'a> {
        let (code, starts) = kernel.code();
        let timing = code.iter().map(|instruction| machine.timing(instruction.operation)).collect();
        let warps_a_block = (kernel.threads as usize).div_ceil(LANES);
        let slots = occupancy.blocks as usize;
        let resident = (slots * warps_a_block * LANES) as u64 * u64::from(machine.sms);
        Launch {
            machine,
            kernel,
            workload,
            program: Program { code, timing, starts, registers: kernel.names + 1 },
            layout: Layout::new(workload, resident),
            sms: (0..machine.sms as usize).map(|id| Sm::new(id, machine, slots, warps_a_block)).collect(),
            memory: Memory::new(machine),
            blocks: workload.trace.rays().div_ceil(kernel.threads as usize),
            started: 0,
            last: 0,
            warps_a_block,
            every_cycle: false,
        }
    }

    fn run(&mut self) -> u64 {
        let mut now = 0;
        let mut room = true;
        loop {
            now += 1;
            if room {
                room = self.dispatch(now);
            }
            for at in 0..self.sms.len() {
                if self.every_cycle || self.sms[at].due(&self.memory, now) {
                    room |= self.sms[at].step(self.machine, &self.program, &mut self.memory, now);
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
        let threads = self.warps_a_block * LANES;
        let first_thread = (threads * (sm + self.sms.len() * slot)) as u64;
        let first_ray = number * self.kernel.threads as usize;
        let rays = self.workload.trace.rays() - first_ray;
        (0..self.warps_a_block.min(rays.div_ceil(LANES)))
            .map(|warp| {
                let thread = first_thread + (warp * LANES) as u64;
                Warp::new(self.workload, self.layout, self.kernel.loops, first_ray + warp * LANES, thread)
            })
            .collect()
    }

    fn prediction(&self, cycles: u64, occupancy: Occupancy) -> Prediction {
        let mut l1 = Counts::default();
        let mut instructions = Instructions::default();
        let mut cpi = CpiStack::default();
        let (mut visits, mut latency) = (0, (0, 0));
        let share = 1.0 / self.sms.len() as f64;
        for sm in &self.sms {
            l1.add(sm.counts);
            instructions.warp += sm.instructions.warp;
            instructions.thread += sm.instructions.thread;
            cpi.add_scaled(&sm.cpi, share);
            visits += sm.visits;
            latency = (latency.0 + sm.latency.0, latency.1 + sm.latency.1);
        }
        let rays = self.workload.trace.rays() as u64;
        let seconds = cycles as f64 / (self.machine.clock_mhz * 1e6);
        let memory = latency.0 as f64 / latency.1.max(1) as f64;
        Prediction {
            cycles,
            mrays_per_s: rays as f64 / seconds / 1e6,
            rays,
            simd_efficiency: instructions.thread as f64 / (instructions.warp.max(1) * LANES as u64) as f64,
            instructions,
            l1: CacheResult::new(l1, visits),
            l2: CacheResult::new(self.memory.counts(), visits),
            latency: Latency { memory, mean: self.machine.sm.load_pipeline as f64 + ADDRESS + l1.miss_rate() * memory },
            occupancy,
            cpi,
            machine: self.machine.name.clone(),
            kernel: self.kernel.name.clone(),
            fidelity: Fidelity::Cycles,
            accounting: Accounting::Full,
            seconds,
        }
    }
}
