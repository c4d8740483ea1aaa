//! Latencies of the memory system: terms of equation (1) of Zhu and Deng 2013.

use super::contention::{Amat, Stage};
use super::machine::{LINE, Machine};
use super::result::{Counts, Latency};

/// Latencies of equation (1), core cycles.
#[derive(Clone, Copy, Debug)]
pub struct Times {
    /// Of the L1.
    pub l1: f64,
    /// Of the network, there and back.
    pub traffic: f64,
    /// Of the L2.
    pub l2: f64,
    /// Of memory.
    pub dram: f64,
}

/// The traffic that a replay without queues finds.
#[derive(Clone, Copy, Debug)]
pub struct Load {
    /// Mean warps at work while any is, on all multiprocessors together.
    pub warps_in_flight: f64,
    /// Mean cycles for which a multiprocessor is at work.
    pub busy_cycles: f64,
    /// Accesses of the L2.
    pub l2: Counts,
}

impl Load {
    /// That of `count` times as many multiprocessors that do the like.
    pub(super) fn times(self, count: f64) -> Load {
        Load { warps_in_flight: self.warps_in_flight * count, l2: self.l2.times(count), ..self }
    }
}

/// A load reads one operand, its address.
pub const ADDRESS: f64 = 1.0;

/// Cycles that a line spends in each of the L2 slice and the multiprocessor besides its latency: one to enter, one to
/// be answered or filled, one to be written back.
const HANDLING: f64 = 3.0;

impl Times {
    /// Without any queue.
    pub fn unloaded(machine: &Machine) -> Times {
        let d = &machine.dram;
        let core = machine.clock_mhz / d.mhz;
        let bursts = (LINE / d.burst).max(1) as f64;
        let l2 = machine.l2.latency as f64 + HANDLING;
        Times {
            l1: machine.sm.load_pipeline as f64 + ADDRESS,
            traffic: 2.0 * machine.crossbar.latency as f64 + reply_cycles(machine) + HANDLING,
            l2,
            dram: l2
                + HANDLING
                + d.latency as f64
                + (d.rcd as f64 + d.cl as f64 + (bursts - 1.0) * d.ccdl as f64) * core,
        }
    }

    /// With what requests wait at the places they share, L2 slices and channels, under `load`.
    pub fn with_queues(self, machine: &Machine, load: &Load) -> Times {
        let misses = load.l2.accesses.max(1) as f64;
        let customers = load.warps_in_flight;
        let think = customers * load.busy_cycles / misses;
        let wait = |servers: u32, service: f64, share: f64| {
            Stage { customers, think: think / share.max(1e-9), servers: f64::from(servers), service }.wait()
        };
        let reply = reply_cycles(machine) + machine.crossbar.gap as f64;
        let l2_miss = load.l2.miss_rate();
        let line = line_cycles(machine);
        let memory = wait(machine.dram.channels, line, l2_miss);
        Times { traffic: self.traffic + wait(machine.l2.slices, reply, 1.0), dram: self.dram + memory, ..self }
    }
}

/// Cycles for which the answer to a miss holds a port.
pub fn reply_cycles(machine: &Machine) -> f64 {
    (machine.crossbar.header + LINE).div_ceil(machine.crossbar.flit) as f64
}

/// Core cycles for which one line of a random row holds a channel: its bursts, or the distance of activations.
pub fn line_cycles(machine: &Machine) -> f64 {
    let d = &machine.dram;
    (d.rrd.max(LINE / d.burst * d.ccd)) as f64 * machine.clock_mhz / d.mhz
}

impl Times {
    /// Mean latency of a line fetched and of an access, at these miss rates.
    pub fn latency(&self, l1: Counts, l2: Counts) -> Latency {
        let amat = Amat {
            l1: self.l1,
            l2: self.l2,
            dram: self.dram,
            traffic: self.traffic,
            l1_miss: l1.miss_rate(),
            l2_miss: l2.miss_rate(),
        };
        let memory = self.traffic + self.l2 + amat.l2_miss * (self.dram - self.l2);
        Latency { memory, mean: amat.mean() }
    }
}
