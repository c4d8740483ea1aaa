//! The replay itself: warps on multiprocessors, the earliest first.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;

use super::second_level::{Found, SecondLevel};
use super::span::{Outcome, Span};
use crate::Result;
use crate::fermi::cache::{Cache, Lookup, Places};
use crate::fermi::kernel::Block;
use crate::fermi::launch::Launch;
use crate::fermi::machine::Machine;
use crate::fermi::needs::Demand;
use crate::fermi::occupancy::launchable;
use crate::fermi::profile::{Cost, profile};
use crate::fermi::result::Counts;
use crate::fermi::simt::{Access, Batch, LANES, Layout, Segment, Warp};
use crate::fermi::times::{Load, Times, reply_cycles};

/// What of a launch is replayed, and where.
#[derive(Clone, Debug)]
pub(super) struct Selection {
    /// Multiprocessors at work.
    pub(super) sms: Range<usize>,
    /// Blocks, in the order in which they are launched.
    pub(super) blocks: Vec<usize>,
    /// Cycles for which the first of them have run, taken alone, when the replay begins.
    pub(super) run: Vec<f64>,
}

impl Selection {
    /// All of it, from the beginning.
    pub(super) fn all(machine: &Machine, launch: &Launch) -> Selection {
        Selection { sms: 0..machine.sms as usize, blocks: (0..launch.blocks()).collect(), run: Vec::new() }
    }
}

/// Where latencies come from.
#[derive(Clone, Copy, Debug)]
pub(super) enum Queues {
    /// They are given.
    Known(Times),
    /// From the traffic so far, if multiprocessors that are not replayed cause as much.
    AsFound,
}

struct Resident<'a> {
    run: Warp<'a>,
    batch: Batch,
    /// Next segment of the batch.
    segment: usize,
    sm: usize,
    slot: usize,
    /// Place of its block among those launched.
    order: usize,
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

pub(super) struct Replay<'a> {
    machine: &'a Machine,
    launch: &'a Launch<'a>,
    selection: Selection,
    costs: [Cost; Block::ALL.len()],
    queues: Queues,
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
    /// Cycles of all warps so far.
    warp_cycles: f64,
}

impl<'a> Replay<'a> {
    /// `room` is that of each L1 for all its lines, if it has.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] if no block fits a multiprocessor.
    pub(super) fn new(
        machine: &'a Machine,
        launch: &'a Launch<'a>,
        selection: Selection,
        queues: Queues,
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
            queues,
            times: match queues {
                Queues::Known(times) => times,
                Queues::AsFound => Times::unloaded(machine),
            },
            reply: reply_cycles(machine) + machine.crossbar.gap as f64,
            layout: Layout::new(&launch.workload, resident).requests_of(machine.l1.request),
            sms: (0..machine.sms).map(sm).collect(),
            l2,
            warps: Vec::new(),
            vacant: Vec::new(),
            next: BinaryHeap::new(),
            spans: Vec::with_capacity(selection.blocks.len()),
            selection,
            warp_cycles: 0.0,
        })
    }

    /// To the end.
    pub(super) fn run(&mut self) -> Outcome {
        self.start();
        while self.step() {}
        let ends = || self.sms[self.selection.sms.clone()].iter().map(|sm| sm.end);
        Outcome {
            cycles: ends().fold(0.0, f64::max),
            busy_cycles: ends().sum::<f64>() / self.selection.sms.len() as f64,
            total: Span::total(&self.spans),
            spans: std::mem::take(&mut self.spans),
        }
    }

    /// Fills all slots.
    pub(super) fn start(&mut self) {
        for slot in 0..self.sms[0].blocks.len() {
            for sm in self.selection.sms.clone() {
                self.launch(sm, slot, 0.0);
            }
        }
    }

    /// Runs the next segment of the warp whose clock is earliest. Returns whether there was one.
    pub(super) fn step(&mut self) -> bool {
        let Some(Reverse((clock, warp))) = self.next.pop() else { return false };
        match self.advance(warp, f64::from_bits(clock)) {
            Some(clock) => self.next.push(Reverse((clock.to_bits(), warp))),
            None => self.finish(warp, f64::from_bits(clock)),
        }
        true
    }

    /// What the L2 did so far.
    pub(super) fn found(&self) -> Found {
        self.l2.found
    }

    /// What was asked of the L1 that was asked for the most lines.
    pub(super) fn demand(&self) -> Option<Demand> {
        let l1 = &self.machine.l1;
        let real = Cache::new(l1.sets(), l1.ways, l1.mapping);
        let of_sm = |sm: &Multiprocessor| {
            Demand::new(sm.data.cache.held().map(|line| real.set(line) as usize), l1.sets() as usize, l1.ways)
        };
        self.sms.iter().map(of_sm).reduce(Demand::or)
    }

    fn launch(&mut self, sm: usize, slot: usize, now: f64) {
        let order = self.spans.len();
        let Some(&block) = self.selection.blocks.get(order) else { return };
        // Until it ends, its beginning.
        self.spans.push(Span { cycles: -now, ..Span::default() });
        let threads = self.launch.block_threads().next_multiple_of(LANES);
        let thread = (threads * (sm + self.sms.len() * slot)) as u64;
        let count = self.launch.warps_of(block);
        self.sms[sm].blocks[slot] = count;
        for warp in 0..count {
            let mut run = Warp::new(self.launch, self.layout, block, warp, thread + (warp * LANES) as u64);
            if let Some(&cycles) = self.selection.run.get(order) {
                skip(&mut run, &self.costs, cycles);
            }
            let resident = Resident { run, batch: Batch::default(), segment: 0, sm, slot, order };
            let place = self.vacant.pop().unwrap_or(self.warps.len());
            match self.warps.get_mut(place) {
                Some(vacant) => *vacant = resident,
                None => self.warps.push(resident),
            }
            self.next.push(Reverse((now.to_bits(), place)));
        }
    }

    fn finish(&mut self, warp: usize, now: f64) {
        let Resident { sm, slot, order, .. } = self.warps[warp];
        self.vacant.push(warp);
        self.sms[sm].end = self.sms[sm].end.max(now);
        self.sms[sm].blocks[slot] -= 1;
        if self.sms[sm].blocks[slot] == 0 {
            self.spans[order].cycles += now;
            if let Queues::AsFound = self.queues {
                self.times = Times::unloaded(self.machine).with_queues(self.machine, &self.load(now));
            }
            self.launch(sm, slot, now);
        }
    }

    /// The traffic of all multiprocessors until `now`.
    fn load(&self, now: f64) -> Load {
        let load = Load { warps_in_flight: self.warp_cycles / now.max(1.0), busy_cycles: now, l2: self.l2.found.all };
        load.times(self.sms.len() as f64 / self.selection.sms.len() as f64)
    }

    /// Runs one segment of a warp from `now` on. Returns its clock after it, none if it has ended.
    fn advance(&mut self, warp: usize, now: f64) -> Option<f64> {
        let Resident { run, batch, segment, sm: at, order: of, .. } = &mut self.warps[warp];
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
        self.warp_cycles += end - now;
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
            self.l2.access(line, &mut self.spans[of]);
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
        let hit = self.l2.access(line, &mut self.spans[of]);
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
                self.l2.access(replaced, &mut self.spans[of]);
            }
        }
        wait + latency
    }
}

/// Takes `warp` through what it does in the first `cycles`, taken alone.
fn skip(warp: &mut Warp, costs: &[Cost], cycles: f64) {
    let mut batch = Batch::without_lines();
    let mut done = 0.0;
    while done < cycles {
        warp.advance(&mut batch);
        if batch.segments.is_empty() {
            return;
        }
        done += batch.segments.iter().map(|segment| costs[segment.block as usize].cycles as f64).sum::<f64>();
    }
}
