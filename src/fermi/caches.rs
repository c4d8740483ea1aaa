//! Fidelity `caches`: every access of every warp through L1 and L2, time by formula.
//!
//! Each warp has a clock that advances block by block: by what the block costs a warp alone, by what equation (1)
//! says its slowest load takes, and by the wait for issue. The warp with the earliest clock goes next, so the order
//! of accesses is about that of the machine. What queues add to a miss comes from the contention model, of the
//! traffic that a first pass without queues finds.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::addresses::Addresses;
use super::cache::{Cache, Lookup};
use super::contention::{Amat, Stage};
use super::kernel::{Block, Kernel};
use super::machine::{LINE, Machine, Mapping};
use super::occupancy::{Occupancy, launchable};
use super::profile::{Cost, profile};
use super::result::{Accounting, CacheResult, Counts, CpiStack, Fidelity, Instructions, Latency, Prediction};
use super::simt::{Access, Batch, LANES, Layout, Segment, Warp, Workload};
use crate::Result;

/// Replays `workload` as `kernel` on `machine`.
///
/// # Errors
/// [`crate::Error::Usage`] if no block fits a multiprocessor.
pub fn replay(machine: &Machine, kernel: &Kernel, workload: &Workload) -> Result<Prediction> {
    let occupancy = launchable(machine, kernel)?;
    let unloaded = Times::unloaded(machine);
    let first = Replay::new(machine, kernel, workload, occupancy, unloaded).run();
    let times = unloaded.with_queues(machine, &first);
    let last = Replay::new(machine, kernel, workload, occupancy, times).run();
    Ok(prediction(machine, kernel, workload, occupancy, times, &last))
}

/// Latencies of equation (1), core cycles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Times {
    pub l1: f64,
    pub traffic: f64,
    pub l2: f64,
    pub dram: f64,
}

/// A load reads one operand, its address.
pub(super) const ADDRESS: f64 = 1.0;

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

    /// With what requests wait at the three places they share: ports to the multiprocessors, L2 slices, and channels.
    fn with_queues(self, machine: &Machine, first: &Outcome) -> Times {
        let misses = first.l2.accesses.max(1) as f64;
        let customers = first.warps_in_flight;
        let think = customers * first.busy_cycles / misses;
        let wait = |servers: u32, service: f64, share: f64| {
            Stage { customers, think: think / share.max(1e-9), servers: f64::from(servers), service }.wait()
        };
        let reply = reply_cycles(machine) + machine.crossbar.gap as f64;
        let l2_miss = first.l2.miss_rate();
        let line = line_cycles(machine);
        let memory = wait(machine.dram.channels, line, l2_miss);
        Times { traffic: self.traffic + wait(machine.l2.slices, reply, 1.0), dram: self.dram + memory, ..self }
    }
}

/// Cycles for which the answer to a miss holds a port.
pub(super) fn reply_cycles(machine: &Machine) -> f64 {
    (machine.crossbar.header + LINE).div_ceil(machine.crossbar.flit) as f64
}

/// Core cycles for which one line of a random row holds a channel: its bursts, or the distance of activations.
pub(super) fn line_cycles(machine: &Machine) -> f64 {
    let d = &machine.dram;
    (d.rrd.max(LINE / d.burst * d.ccd)) as f64 * machine.clock_mhz / d.mhz
}

/// What a pass finds.
#[derive(Clone, Debug, Default)]
pub(super) struct Outcome {
    pub cycles: f64,
    pub l1: Counts,
    pub l2: Counts,
    pub instructions: Instructions,
    pub visits: u64,
    /// Mean warps at work while any is, on all multiprocessors together.
    pub warps_in_flight: f64,
    /// Mean cycles for which a multiprocessor is at work.
    pub busy_cycles: f64,
    /// Cycles that warps spent in arithmetic and in waiting for loads.
    pub compute: f64,
    pub memory: f64,
}

struct Resident<'a> {
    run: Warp<'a>,
    batch: Batch,
    /// Next segment of the batch.
    segment: usize,
    sm: usize,
    block: usize,
}

struct Multiprocessor {
    cache: Cache,
    /// When each line of the cache comes.
    fills: Vec<f64>,
    /// When lines under way come, soonest first.
    under_way: BinaryHeap<Reverse<u64>>,
    issue_free: f64,
    port_free: f64,
    /// When the port from the network is free of lines asked for so far.
    reply_free: f64,
    /// Warps left of each resident block.
    blocks: Vec<usize>,
    end: f64,
}

struct Replay<'a> {
    machine: &'a Machine,
    kernel: &'a Kernel,
    workload: &'a Workload<'a>,
    costs: [Cost; Block::ALL.len()],
    times: Times,
    /// Cycles for which a line holds the port to its multiprocessor.
    reply: f64,
    layout: Layout,
    sms: Vec<Multiprocessor>,
    addresses: Addresses,
    l2: Vec<Cache>,
    warps: Vec<Resident<'a>>,
    /// Clock and number of each warp, earliest first.
    next: BinaryHeap<Reverse<(u64, usize)>>,
    started: usize,
    ticks: u64,
    outcome: Outcome,
}

impl<'a> Replay<'a> {
    fn new(
        machine: &'a Machine,
        kernel: &'a Kernel,
        workload: &'a Workload<'a>,
        occupancy: Occupancy,
        times: Times,
    ) -> Replay<'a> {
        let resident = u64::from(occupancy.warps) * LANES as u64 * u64::from(machine.sms);
        let lines = (machine.l1.sets() * machine.l1.ways) as usize;
        let sm = |_| Multiprocessor {
            cache: Cache::new(machine.l1.sets(), machine.l1.ways, machine.l1.mapping),
            fills: vec![0.0; lines],
            under_way: BinaryHeap::new(),
            issue_free: 0.0,
            port_free: 0.0,
            reply_free: 0.0,
            blocks: vec![0; occupancy.blocks as usize],
            end: 0.0,
        };
        let slice = Cache::new(machine.l2.slice_kib * 1024 / LINE / machine.l2.ways, machine.l2.ways, Mapping::Linear);
        Replay {
            machine,
            kernel,
            workload,
            costs: profile(machine, kernel),
            times,
            reply: reply_cycles(machine) + machine.crossbar.gap as f64,
            layout: Layout::new(workload, resident),
            sms: (0..machine.sms).map(sm).collect(),
            addresses: Addresses::new(machine),
            l2: vec![slice; machine.l2.slices as usize],
            warps: Vec::new(),
            next: BinaryHeap::new(),
            started: 0,
            ticks: 0,
            outcome: Outcome::default(),
        }
    }

    fn run(mut self) -> Outcome {
        for slot in 0..self.sms[0].blocks.len() {
            for sm in 0..self.sms.len() {
                self.launch(sm, slot, 0.0);
            }
        }
        while let Some(Reverse((clock, warp))) = self.next.pop() {
            let end = self.advance(warp, f64::from_bits(clock));
            match end {
                Some(clock) => self.next.push(Reverse((clock.to_bits(), warp))),
                None => self.finish(warp, f64::from_bits(clock)),
            }
        }
        let sms = self.sms.len() as f64;
        let mut outcome = self.outcome;
        outcome.cycles = self.sms.iter().map(|sm| sm.end).fold(0.0, f64::max);
        outcome.busy_cycles = self.sms.iter().map(|sm| sm.end).sum::<f64>() / sms;
        outcome.warps_in_flight = (outcome.compute + outcome.memory) / outcome.busy_cycles.max(1.0);
        outcome
    }

    fn launch(&mut self, sm: usize, slot: usize, now: f64) {
        let threads = self.kernel.threads as usize;
        let first = self.started * threads;
        let rays = self.workload.trace.rays();
        if first >= rays {
            return;
        }
        self.started += 1;
        let padded = threads.next_multiple_of(LANES);
        let thread = (padded * (sm + self.sms.len() * slot)) as u64;
        let count = (rays - first).min(threads).div_ceil(LANES);
        self.sms[sm].blocks[slot] = count;
        for i in 0..count {
            let offset = i * LANES;
            let run = Warp::new(self.workload, self.layout, self.kernel.loops, first + offset, thread + offset as u64);
            self.warps.push(Resident { run, batch: Batch::default(), segment: 0, sm, block: slot });
            self.next.push(Reverse((now.to_bits(), self.warps.len() - 1)));
        }
    }

    fn finish(&mut self, warp: usize, now: f64) {
        let (sm, slot) = (self.warps[warp].sm, self.warps[warp].block);
        self.sms[sm].end = self.sms[sm].end.max(now);
        self.sms[sm].blocks[slot] -= 1;
        if self.sms[sm].blocks[slot] == 0 {
            self.launch(sm, slot, now);
        }
    }

    /// Runs one segment of a warp from `now` on. Returns its clock after it, none if it has ended.
    fn advance(&mut self, warp: usize, now: f64) -> Option<f64> {
        let Resident { run, batch, segment, sm: at, .. } = &mut self.warps[warp];
        if *segment == batch.segments.len() {
            run.advance(batch);
            *segment = 0;
        }
        let Segment { block, lanes, memory } = *batch.segments.get(*segment)?;
        *segment += 1;
        let (batch, at) = (std::mem::take(batch), *at);
        let cost = self.costs[block as usize];
        let mut slowest: f64 = 0.0;
        for op in &batch.memory[memory.0 as usize..memory.1 as usize] {
            for &line in &batch.lines[op.lines.0 as usize..op.lines.1 as usize] {
                slowest = slowest.max(self.access(at, op.access, line, now));
            }
        }
        self.warps[warp].batch = batch;
        let width = f64::from(self.machine.sm.schedulers.min(self.machine.sm.fetch));
        let sm = &mut self.sms[at];
        sm.issue_free = sm.issue_free.max(now) + cost.instructions as f64 / width;
        let end = (now + cost.with(slowest as u64) as f64).max(sm.issue_free);
        self.outcome.compute += cost.cycles as f64;
        self.outcome.memory += end - now - cost.cycles as f64;
        self.outcome.instructions.warp += cost.instructions;
        self.outcome.instructions.thread += cost.instructions * u64::from(lanes);
        self.outcome.visits += u64::from(matches!(block, Block::Node | Block::Leaf));
        Some(end)
    }

    /// One line through the L1, one a cycle. Returns the cycles that it takes more than a hit.
    fn access(&mut self, at: usize, access: Access, line: u64, now: f64) -> f64 {
        self.ticks += 1;
        let ticks = self.ticks;
        let sm = &mut self.sms[at];
        let start = sm.port_free.max(now);
        sm.port_free = start + 1.0;
        self.outcome.l1.accesses += 1;
        let mut wait = start - now;
        let found = sm.cache.look(line);
        if let (Lookup::Hit(way) | Lookup::Pending(way), false) = (found, access == Access::Store) {
            sm.cache.touch(way, ticks);
            if access == Access::Push {
                sm.cache.dirty(way);
            } else if sm.fills[way] > start {
                self.outcome.l1.pending_hits += 1;
                return wait + sm.fills[way] - start;
            }
            return wait;
        }
        self.outcome.l1.misses += 1;
        if access.writes() {
            if let Lookup::Hit(way) | Lookup::Pending(way) = found {
                sm.cache.evict(way);
            }
            self.second_level(line);
            return wait;
        }
        // With all MSHRs taken, the load pipeline stands still until the first line comes.
        while sm.under_way.peek().is_some_and(|&Reverse(fill)| f64::from_bits(fill) <= start + wait) {
            sm.under_way.pop();
        }
        if sm.under_way.len() >= self.machine.l1.mshrs
            && let Some(Reverse(fill)) = sm.under_way.pop()
        {
            wait += (f64::from_bits(fill) - start).max(0.0);
            sm.port_free = start + wait + 1.0;
            self.outcome.l1.refused += 1;
        }
        let hit = self.second_level(line);
        let latency = self.times.traffic + if hit { self.times.l2 } else { self.times.dram };
        // Lines come one after the other, and a warp asks for several at once.
        let sm = &mut self.sms[at];
        let asked = now + wait;
        let queue = (sm.reply_free - asked).max(0.0);
        sm.reply_free = asked + queue + self.reply;
        wait += queue;
        let fill = now + wait + latency;
        if let Lookup::Miss(way) = found {
            let replaced = sm.cache.reserve(way, line, ticks);
            sm.cache.fill(way);
            sm.fills[way] = fill;
            sm.under_way.push(Reverse(fill.to_bits()));
            if let Some(replaced) = replaced {
                self.second_level(replaced);
            }
        }
        wait + latency
    }

    /// One line through the L2. Returns whether it was there.
    fn second_level(&mut self, line: u64) -> bool {
        self.outcome.l2.accesses += 1;
        let home = self.addresses.home(line);
        let slice = &mut self.l2[home.slice];
        match slice.look(home.local) {
            Lookup::Hit(way) | Lookup::Pending(way) => {
                slice.touch(way, self.ticks);
                true
            }
            Lookup::Miss(way) => {
                self.outcome.l2.misses += 1;
                slice.reserve(way, home.local, self.ticks);
                slice.fill(way);
                false
            }
            Lookup::Full => false,
        }
    }
}

fn prediction(
    machine: &Machine,
    kernel: &Kernel,
    workload: &Workload,
    occupancy: Occupancy,
    times: Times,
    outcome: &Outcome,
) -> Prediction {
    let sms = f64::from(machine.sms);
    // The throughput law: no faster than issue and the channels allow.
    let issue = outcome.instructions.warp as f64 / sms / f64::from(machine.sm.schedulers.min(machine.sm.fetch));
    let memory = outcome.l2.misses as f64 * line_cycles(machine) / f64::from(machine.dram.channels);
    let cycles = outcome.cycles.max(issue).max(memory).ceil();
    let efficiency = outcome.instructions.thread as f64 / (outcome.instructions.warp.max(1) * LANES as u64) as f64;
    let stalled = (outcome.busy_cycles - issue).max(0.0);
    let share = outcome.memory / (outcome.memory + outcome.compute).max(1.0);
    let amat = Amat {
        l1: times.l1,
        l2: times.l2,
        dram: times.dram,
        traffic: times.traffic,
        l1_miss: outcome.l1.miss_rate(),
        l2_miss: outcome.l2.miss_rate(),
    };
    let rays = workload.trace.rays() as u64;
    let seconds = cycles / (machine.clock_mhz * 1e6);
    Prediction {
        cycles: cycles as u64,
        mrays_per_s: rays as f64 / seconds / 1e6,
        rays,
        simd_efficiency: efficiency,
        instructions: outcome.instructions,
        l1: CacheResult::new(outcome.l1, outcome.visits),
        l2: CacheResult::new(outcome.l2, outcome.visits),
        latency: Latency {
            memory: times.traffic + times.l2 + amat.l2_miss * (times.dram - times.l2),
            mean: amat.mean(),
        },
        occupancy,
        cpi: CpiStack {
            base: issue * efficiency,
            divergence: issue * (1.0 - efficiency),
            compute_data: stalled * (1.0 - share),
            memory_data: stalled * share,
            idle: cycles - issue - stalled,
            ..CpiStack::default()
        },
        machine: machine.name.clone(),
        kernel: kernel.name.clone(),
        fidelity: Fidelity::Caches,
        accounting: Accounting::Full,
        seconds,
    }
}
