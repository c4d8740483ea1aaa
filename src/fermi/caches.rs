//! Fidelity `caches`: every access of every warp through L1 and L2, time by formula.
//!
//! Each warp has a clock that advances block by block: by what the block costs a warp alone, by what equation (1)
//! says its slowest load takes, and by the wait for issue. The warp with the earliest clock goes next, so the order
//! of accesses is about that of the machine. What queues add to a miss comes from the contention model, of the
//! traffic that a first pass without queues finds.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::addresses::Addresses;
use super::cache::{Cache, Lookup, Places};
use super::kernel::Block;
use super::launch::Launch;
use super::machine::{Machine, Mapping};
use super::needs::Demand;
use super::occupancy::launchable;
use super::profile::{Cost, profile};
use super::result::{Counts, CpiStack, Instructions, Part};
use super::simt::{Access, Batch, LANES, Layout, Segment, Warp};
use super::times::{Load, Times, line_cycles, reply_cycles};
use crate::Result;

/// Replays `launches`, one after the other; the L2 keeps what it has.
///
/// # Errors
/// [`crate::Error::Usage`] if no block fits a multiprocessor.
pub fn replay(machine: &Machine, launches: &[Launch]) -> Result<Vec<Part>> {
    let unloaded = Times::unloaded(machine);
    let mut l2 = SecondLevel::new(machine, None);
    let mut loads = Vec::new();
    for launch in launches {
        loads.push(Replay::new(machine, launch, unloaded, (None, &mut l2))?.run().load());
    }
    let mut l2 = SecondLevel::new(machine, None);
    let mut parts = Vec::new();
    for (launch, load) in launches.iter().zip(loads) {
        let times = unloaded.with_queues(machine, &load);
        let outcome = Replay::new(machine, launch, times, (None, &mut l2))?.run();
        parts.push(part(machine, launch, times, &outcome)?);
    }
    Ok(parts)
}

/// What a block of threads did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Span {
    /// Cycles from its launch to its end.
    pub cycles: f64,
    /// Accesses of the L1 by its warps.
    pub l1: Counts,
    /// Accesses of the L2 that followed.
    pub l2: Counts,
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
    /// Adds `times` what another block did.
    pub(super) fn add(&mut self, other: &Span, times: f64) {
        let scaled = |n: u64| (n as f64 * times).round() as u64;
        let counts = |c: Counts| Counts {
            accesses: scaled(c.accesses),
            misses: scaled(c.misses),
            pending_hits: scaled(c.pending_hits),
            refused: scaled(c.refused),
        };
        self.cycles += other.cycles * times;
        self.l1.add(counts(other.l1));
        self.l2.add(counts(other.l2));
        self.instructions.warp += scaled(other.instructions.warp);
        self.instructions.thread += scaled(other.instructions.thread);
        self.visits += scaled(other.visits);
        self.compute += other.compute * times;
        self.memory += other.memory * times;
    }
}

/// What a pass finds.
#[derive(Clone, Debug)]
pub(super) struct Outcome {
    /// Of the launch.
    pub(super) cycles: f64,
    /// Mean cycles for which a multiprocessor is at work.
    pub(super) busy_cycles: f64,
    /// All blocks together.
    pub(super) total: Span,
    /// Each block.
    pub(super) spans: Vec<Span>,
}

impl Outcome {
    pub(super) fn load(&self) -> Load {
        let warps_in_flight = (self.total.compute + self.total.memory) / self.busy_cycles.max(1.0);
        Load { warps_in_flight, busy_cycles: self.busy_cycles, l2: self.total.l2 }
    }
}

/// One pass over `launch` with an L2 that is empty at first, loads taking `times`.
///
/// # Errors
/// [`crate::Error::Usage`] if no block fits a multiprocessor.
pub(super) fn pass(machine: &Machine, launch: &Launch, times: Times) -> Result<Outcome> {
    Ok(Replay::new(machine, launch, times, (None, &mut SecondLevel::new(machine, None)))?.run())
}

/// Caches that hold all that a launch can touch, and so need no replay: see [`super::needs`].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Room {
    /// Places of lines in each first-level cache.
    pub(super) l1: Option<Places>,
    /// Places of lines in the second-level cache.
    pub(super) l2: Option<Places>,
}

/// The same with caches that have `room`, and what was asked of the L1 of the multiprocessor that asked for the most and
/// of the L2, where they have.
///
/// # Errors
/// [`crate::Error::Usage`] if no block fits a multiprocessor.
pub(super) fn pass_in(
    machine: &Machine,
    launch: &Launch,
    times: Times,
    room: Room,
) -> Result<(Outcome, [Option<Demand>; 2])> {
    let mut l2 = SecondLevel::new(machine, room.l2);
    let mut replay = Replay::new(machine, launch, times, (room.l1, &mut l2))?;
    let outcome = replay.run();
    let real = Cache::new(machine.l1.sets(), machine.l1.ways, machine.l1.mapping);
    let of_sm = |sm: &Multiprocessor| {
        Demand::new(
            sm.data.cache.held().map(|line| real.set(line) as usize),
            machine.l1.sets() as usize,
            machine.l1.ways,
        )
    };
    let l1 = room.l1.and_then(|_| replay.sms.iter().map(of_sm).reduce(Demand::or));
    let (addresses, sets) = (Addresses::new(machine), machine.l2.sets() as usize);
    let set = |line: u64| {
        let home = addresses.home(line);
        home.slice * sets + home.local as usize % sets
    };
    let l2 =
        room.l2.map(|_| Demand::new(l2.slices[0].held().map(set), sets * machine.l2.slices as usize, machine.l2.ways));
    Ok((outcome, [l1, l2]))
}

struct Resident<'a> {
    run: Warp<'a>,
    batch: Batch,
    /// Next segment of the batch.
    segment: usize,
    sm: usize,
    slot: usize,
    block: usize,
}

/// A cache of a multiprocessor.
#[derive(Clone)]
struct FirstLevel {
    cache: Cache,
    /// When each line of the cache comes.
    fills: Vec<f64>,
    port_free: f64,
}

impl FirstLevel {
    fn new(cache: Cache) -> FirstLevel {
        FirstLevel { fills: vec![0.0; cache.lines()], cache, port_free: 0.0 }
    }
}

struct Multiprocessor {
    data: FirstLevel,
    texture: FirstLevel,
    /// When lines of the L1 under way come, soonest first.
    under_way: BinaryHeap<Reverse<u64>>,
    issue_free: f64,
    /// When the port from the network is free of lines asked for so far.
    reply_free: f64,
    /// Warps left of the block in each slot.
    blocks: Vec<usize>,
    end: f64,
}

struct Replay<'a> {
    machine: &'a Machine,
    launch: &'a Launch<'a>,
    costs: [Cost; Block::ALL.len()],
    times: Times,
    /// Cycles for which a line holds the port to its multiprocessor.
    reply: f64,
    layout: Layout,
    sms: Vec<Multiprocessor>,
    l2: &'a mut SecondLevel,
    warps: Vec<Resident<'a>>,
    /// Places of warps that have ended.
    vacant: Vec<usize>,
    /// Clock and number of each warp, earliest first.
    next: BinaryHeap<Reverse<(u64, usize)>>,
    /// Blocks launched so far.
    spans: Vec<Span>,
}

/// The L2, which outlives a launch.
struct SecondLevel {
    /// How lines are spread over slices; none where one cache stands for all of them.
    addresses: Option<Addresses>,
    slices: Vec<Cache>,
    /// Accesses of all caches so far: the clock of their replacement.
    ticks: u64,
}

impl SecondLevel {
    fn new(machine: &Machine, room: Option<Places>) -> SecondLevel {
        let slices = match room {
            Some(places) => vec![Cache::roomy(places)],
            None => {
                let slice = Cache::new(machine.l2.sets(), machine.l2.ways, Mapping::Linear);
                vec![slice; machine.l2.slices as usize]
            }
        };
        let addresses = room.is_none().then(|| Addresses::new(machine));
        SecondLevel { addresses, slices, ticks: 0 }
    }

    /// One line. Returns whether it was there.
    fn access(&mut self, line: u64, counts: &mut Counts) -> bool {
        counts.accesses += 1;
        let home = self.addresses.map(|addresses| addresses.home(line));
        let (slice, local) = home.map_or((0, line), |home| (home.slice, home.local));
        let slice = &mut self.slices[slice];
        match slice.look(local) {
            Lookup::Hit(way) | Lookup::Pending(way) => {
                slice.touch(way, self.ticks);
                true
            }
            Lookup::Miss(way) => {
                counts.misses += 1;
                slice.reserve(way, local, self.ticks);
                slice.fill(way);
                false
            }
            Lookup::Full => false,
        }
    }
}

impl<'a> Replay<'a> {
    fn new(
        machine: &'a Machine,
        launch: &'a Launch<'a>,
        times: Times,
        (room, l2): (Option<Places>, &'a mut SecondLevel),
    ) -> Result<Replay<'a>> {
        let slots = launch.slots(launchable(machine, launch)?.blocks);
        let resident = (slots * launch.block_threads().next_multiple_of(LANES)) as u64 * u64::from(machine.sms);
        let cache = match room {
            Some(places) => Cache::roomy(places),
            None => Cache::new(machine.l1.sets(), machine.l1.ways, machine.l1.mapping).times(launch.caches()),
        };
        let sm = |_| Multiprocessor {
            data: FirstLevel::new(cache.clone()),
            texture: FirstLevel::new(machine.texture.cache()),
            under_way: BinaryHeap::new(),
            issue_free: 0.0,
            reply_free: 0.0,
            blocks: vec![0; slots],
            end: 0.0,
        };
        Ok(Replay {
            machine,
            launch,
            costs: profile(machine, launch.kernel),
            times,
            reply: reply_cycles(machine) + machine.crossbar.gap as f64,
            layout: Layout::new(&launch.workload, resident).requests_of(machine.l1.request),
            sms: (0..machine.sms).map(sm).collect(),
            l2,
            warps: Vec::new(),
            vacant: Vec::new(),
            next: BinaryHeap::new(),
            spans: Vec::with_capacity(launch.blocks()),
        })
    }

    fn run(&mut self) -> Outcome {
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
        let ends = || self.sms.iter().map(|sm| sm.end);
        let mut total = Span::default();
        self.spans.iter().for_each(|span| total.add(span, 1.0));
        Outcome {
            cycles: ends().fold(0.0, f64::max),
            busy_cycles: ends().sum::<f64>() / self.sms.len() as f64,
            total,
            spans: std::mem::take(&mut self.spans),
        }
    }

    fn launch(&mut self, sm: usize, slot: usize, now: f64) {
        let block = self.spans.len();
        if block == self.launch.blocks() {
            return;
        }
        // Until it ends, its beginning.
        self.spans.push(Span { cycles: -now, ..Span::default() });
        let threads = self.launch.block_threads().next_multiple_of(LANES);
        let thread = (threads * (sm + self.sms.len() * slot)) as u64;
        let count = self.launch.warps_of(block);
        self.sms[sm].blocks[slot] = count;
        for warp in 0..count {
            let run = Warp::new(self.launch, self.layout, block, warp, thread + (warp * LANES) as u64);
            let resident = Resident { run, batch: Batch::default(), segment: 0, sm, slot, block };
            let place = self.vacant.pop().unwrap_or(self.warps.len());
            match self.warps.get_mut(place) {
                Some(vacant) => *vacant = resident,
                None => self.warps.push(resident),
            }
            self.next.push(Reverse((now.to_bits(), place)));
        }
    }

    fn finish(&mut self, warp: usize, now: f64) {
        let Resident { sm, slot, block, .. } = self.warps[warp];
        self.vacant.push(warp);
        self.sms[sm].end = self.sms[sm].end.max(now);
        self.sms[sm].blocks[slot] -= 1;
        if self.sms[sm].blocks[slot] == 0 {
            self.spans[block].cycles += now;
            self.launch(sm, slot, now);
        }
    }

    /// Runs one segment of a warp from `now` on. Returns its clock after it, none if it has ended.
    fn advance(&mut self, warp: usize, now: f64) -> Option<f64> {
        let Resident { run, batch, segment, sm: at, block: of, .. } = &mut self.warps[warp];
        if *segment == batch.segments.len() {
            run.advance(batch);
            *segment = 0;
        }
        let Segment { block, lanes, memory } = *batch.segments.get(*segment)?;
        *segment += 1;
        let (batch, at, of) = (std::mem::take(batch), *at, *of);
        let cost = self.costs[block as usize];
        let mut slowest: f64 = 0.0;
        let (requests, missed) = (self.spans[of].l1.accesses, self.spans[of].l1.misses);
        let ops = &batch.memory[memory.0 as usize..memory.1 as usize];
        for op in ops {
            for &line in &batch.lines[op.lines.0 as usize..op.lines.1 as usize] {
                slowest = slowest.max(self.access((at, of), op.access, line, now));
            }
        }
        // Instructions issued again: once for each request but the first, and for each line that comes late.
        let first = ops.iter().filter(|op| op.access != Access::Texture).count() as u64;
        let span = &self.spans[of].l1;
        let again = (span.accesses - requests).saturating_sub(first) + (span.misses - missed);
        let issues = cost.instructions + if self.machine.sm.replay { again } else { 0 };
        self.warps[warp].batch = batch;
        let width = f64::from(self.machine.sm.schedulers.min(self.machine.sm.fetch));
        let sm = &mut self.sms[at];
        sm.issue_free = sm.issue_free.max(now) + issues as f64 / width;
        let end = (now + cost.with(slowest as u64) as f64).max(sm.issue_free);
        let span = &mut self.spans[of];
        span.compute += cost.cycles as f64;
        span.memory += end - now - cost.cycles as f64;
        span.instructions.issue(cost.instructions, lanes);
        span.visits += u64::from(block.visits());
        Some(end)
    }

    /// One line through the L1 of multiprocessor `at` for block `of`, one a cycle. Returns the cycles that it takes
    /// more than a hit.
    fn access(&mut self, (at, of): (usize, usize), access: Access, line: u64, now: f64) -> f64 {
        self.l2.ticks += 1;
        let ticks = self.l2.ticks;
        let virtual_cache = match self.launch.virtual_caches {
            true => self.layout.virtual_cache(&self.launch.workload, line),
            false => 0,
        };
        let texture = access == Access::Texture;
        let sm = &mut self.sms[at];
        let first = if texture { &mut sm.texture } else { &mut sm.data };
        let start = first.port_free.max(now);
        first.port_free = start + 1.0;
        let mut ignored = Counts::default();
        let counts = if texture { &mut ignored } else { &mut self.spans[of].l1 };
        counts.accesses += 1;
        let mut wait = start - now;
        let found = first.cache.look_in(virtual_cache, line);
        if let (Lookup::Hit(way) | Lookup::Pending(way), false) = (found, access == Access::Store) {
            first.cache.touch(way, ticks);
            if access == Access::Push {
                first.cache.dirty(way);
            } else if first.fills[way] > start {
                counts.pending_hits += 1;
                return wait + first.fills[way] - start;
            }
            return wait;
        }
        counts.misses += 1;
        if access.writes() {
            if let Lookup::Hit(way) | Lookup::Pending(way) = found {
                first.cache.evict(way);
            }
            self.l2.access(line, &mut self.spans[of].l2);
            return wait;
        }
        // With all MSHRs taken, the load pipeline stands still until the first line comes.
        while sm.under_way.peek().is_some_and(|&Reverse(fill)| f64::from_bits(fill) <= start + wait) {
            sm.under_way.pop();
        }
        if !texture
            && sm.under_way.len() >= self.machine.l1.mshrs
            && let Some(Reverse(fill)) = sm.under_way.pop()
        {
            wait += (f64::from_bits(fill) - start).max(0.0);
            first.port_free = start + wait + 1.0;
            self.spans[of].l1.refused += 1;
        }
        let hit = self.l2.access(line, &mut self.spans[of].l2);
        let latency = self.times.traffic + if hit { self.times.l2 } else { self.times.dram };
        // Lines come one after the other, and a warp asks for several at once.
        let asked = now + wait;
        let queue = (sm.reply_free - asked).max(0.0);
        sm.reply_free = asked + queue + self.reply;
        wait += queue;
        let fill = now + wait + latency;
        if let Lookup::Miss(way) = found {
            let replaced = first.cache.reserve(way, line, ticks);
            first.cache.fill(way);
            first.fills[way] = fill;
            if !texture {
                sm.under_way.push(Reverse(fill.to_bits()));
            }
            if let Some(replaced) = replaced {
                self.l2.access(replaced, &mut self.spans[of].l2);
            }
        }
        wait + latency
    }
}

/// The result of a launch.
pub(super) fn part(machine: &Machine, launch: &Launch, times: Times, outcome: &Outcome) -> Result<Part> {
    let total = &outcome.total;
    let sms = f64::from(machine.sms);
    // The throughput law: no faster than issue and the channels allow.
    let issue = total.instructions.warp as f64 / sms / f64::from(machine.sm.schedulers.min(machine.sm.fetch));
    let memory = total.l2.misses as f64 * line_cycles(machine) / f64::from(machine.dram.channels);
    let cycles = outcome.cycles.max(issue).max(memory).ceil();
    let efficiency = total.instructions.efficiency();
    let stalled = (outcome.busy_cycles - issue).max(0.0);
    let share = total.memory / (total.memory + total.compute).max(1.0);
    Ok(Part {
        stage: launch.stage,
        cycles,
        instructions: total.instructions,
        visits: total.visits,
        l1: total.l1,
        l2: total.l2,
        latency: times.latency(total.l1, total.l2),
        occupancy: launchable(machine, launch)?,
        cpi: CpiStack {
            base: issue * efficiency,
            divergence: issue * (1.0 - efficiency),
            compute_data: stalled * (1.0 - share),
            memory_data: stalled * share,
            idle: cycles - issue - stalled,
            ..CpiStack::default()
        },
    })
}
