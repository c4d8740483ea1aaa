//! Everything below the multiprocessors: network, L2 slices, memory channels.

use std::collections::VecDeque;

use super::crossbar::Crossbar;
use super::dram::Channel;
use crate::fermi::addresses::Addresses;
use crate::fermi::cache::{Cache, Lookup};
use crate::fermi::machine::{LINE, Machine, Mapping};
use crate::fermi::result::Counts;

/// What a request is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A multiprocessor wants a line.
    Read,
    /// A multiprocessor wants a line of code.
    Fetch,
    /// A multiprocessor writes; it is told when that is done.
    Write,
    /// A multiprocessor writes a line back; it is not told.
    Writeback,
    /// The L2 wants a line because one was written that it does not have.
    Allocate,
    /// The L2 writes a line back.
    Spill,
}

/// A request on its way down or up.
#[derive(Clone, Copy, Debug)]
pub struct Request {
    /// What it is.
    pub kind: Kind,
    /// Line number.
    pub line: u64,
    /// Bytes it moves.
    pub bytes: u16,
    /// Multiprocessor it came from.
    pub sm: u16,
    /// Its warp slot there.
    pub warp: u16,
    /// Cycle in which it was sent.
    pub sent: u64,
}

impl Request {
    /// Whether it moves data down.
    pub fn writes(&self) -> bool {
        matches!(self.kind, Kind::Write | Kind::Writeback | Kind::Spill)
    }

    /// Whether a multiprocessor gets the line.
    pub fn reads(&self) -> bool {
        matches!(self.kind, Kind::Read | Kind::Fetch)
    }

    /// Whether memory sends something back.
    pub fn wants_answer(&self) -> bool {
        !matches!(self.kind, Kind::Writeback | Kind::Spill)
    }
}

/// An L2 slice.
#[derive(Clone, Debug)]
struct Slice {
    /// Requests that wait out the latency.
    delayed: VecDeque<(u64, Request)>,
    waiting: VecDeque<Request>,
    cache: Cache,
    /// Requests by line of the cache that is on its way.
    merged: Vec<Vec<Request>>,
    under_way: usize,
    misses: VecDeque<Request>,
    to_dram: VecDeque<Request>,
    from_dram: VecDeque<Request>,
    /// Lines that came, whose requests are being answered.
    ready: VecDeque<VecDeque<Request>>,
    port_free: u64,
    fill_free: u64,
    /// Requests at the channel or on the way to it.
    credits: usize,
}

impl Slice {
    fn idle(&self) -> bool {
        self.delayed.is_empty()
            && self.waiting.is_empty()
            && self.misses.is_empty()
            && self.to_dram.is_empty()
            && self.from_dram.is_empty()
            && self.ready.is_empty()
    }
}

/// The memory system.
#[derive(Clone, Debug)]
pub struct Memory {
    machine: Machine,
    addresses: Addresses,
    /// From multiprocessors to slices.
    pub down: Crossbar,
    /// From slices to multiprocessors.
    pub up: Crossbar,
    slices: Vec<Slice>,
    channels: Vec<Channel>,
    /// Requests on their way to each channel.
    delay: Vec<VecDeque<(u64, Request)>>,
    turn: Vec<usize>,
    /// Part of a cycle of the channels' clock that has passed, in units of 1 / `clocks.1`.
    ticks: u64,
    /// Clocks of memory and core, kHz.
    clocks: (u64, u64),
    counts: Counts,
}

impl Memory {
    /// An idle memory system.
    pub fn new(machine: &Machine) -> Memory {
        let (sms, slices) = (machine.sms as usize, machine.l2.slices as usize);
        let channels = machine.dram.channels as usize;
        let crossbar = |inputs, outputs| {
            Crossbar::new(inputs, outputs, machine.crossbar.latency, machine.crossbar.gap, machine.crossbar.queue)
        };
        let sets = machine.l2.slice_kib * 1024 / LINE / machine.l2.ways;
        let slice = Slice {
            delayed: VecDeque::new(),
            waiting: VecDeque::new(),
            cache: Cache::new(sets, machine.l2.ways, Mapping::Linear),
            merged: vec![Vec::new(); (sets * machine.l2.ways) as usize],
            under_way: 0,
            misses: VecDeque::new(),
            to_dram: VecDeque::new(),
            from_dram: VecDeque::new(),
            ready: VecDeque::new(),
            port_free: 0,
            fill_free: 0,
            credits: 0,
        };
        Memory {
            down: crossbar(sms, slices),
            up: crossbar(slices, sms),
            slices: vec![slice; slices],
            channels: vec![Channel::new(&machine.dram); channels],
            delay: vec![VecDeque::new(); channels],
            turn: vec![0; channels],
            ticks: 0,
            clocks: ((machine.dram.mhz * 1e3).round() as u64, (machine.clock_mhz * 1e3).round() as u64),
            counts: Counts::default(),
            addresses: Addresses::new(machine),
            machine: machine.clone(),
        }
    }

    /// What the L2 saw.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Whether nothing is under way.
    pub fn idle(&self) -> bool {
        self.down.idle()
            && self.up.idle()
            && self.slices.iter().all(Slice::idle)
            && self.channels.iter().all(Channel::idle)
            && self.delay.iter().all(VecDeque::is_empty)
    }

    /// Whether multiprocessor `sm` cannot send now.
    pub fn full(&self, sm: usize) -> bool {
        self.down.full(sm)
    }

    /// Sends a request.
    pub fn send(&mut self, request: Request, now: u64) {
        let data = if request.writes() { u64::from(request.bytes) } else { 0 };
        let flits = self.flits(data);
        let slice = self.addresses.home(request.line).slice;
        self.down.push(usize::from(request.sm), slice, request, flits, now);
    }

    fn flits(&self, data: u64) -> u64 {
        (self.machine.crossbar.header + data).div_ceil(self.machine.crossbar.flit)
    }

    /// One core cycle.
    pub fn step(&mut self, now: u64) {
        self.up.step(now);
        for _ in 0..self.channel_cycles(1) {
            for channel in 0..self.channels.len() {
                self.step_channel(channel, now);
            }
        }
        for slice in 0..self.slices.len() {
            self.step_slice(slice, now);
        }
        self.down.step(now);
    }

    /// Lets `cycles` pass in which nothing is under way.
    pub fn skip(&mut self, cycles: u64) {
        let passed = self.channel_cycles(cycles);
        self.channels.iter_mut().for_each(|channel| channel.skip(passed));
    }

    /// Cycles of the channels' clock that `cycles` of the core's bring.
    fn channel_cycles(&mut self, cycles: u64) -> u64 {
        let (memory, core) = self.clocks;
        self.ticks += cycles * memory;
        let passed = self.ticks / core;
        self.ticks %= core;
        passed
    }

    fn step_channel(&mut self, at: usize, now: u64) {
        let parts = self.slices.len() / self.channels.len();
        if let Some(line) = self.channels[at].top().map(|request| request.line) {
            let slice = self.addresses.home(line).slice;
            if self.slices[slice].from_dram.len() < self.machine.l2.queue
                && let Some(request) = self.channels[at].pop()
            {
                self.slices[slice].credits -= 1;
                self.slices[slice].from_dram.push_back(request);
            }
        }
        self.channels[at].step();
        // Slices take turns to send one request; each always has room for one, and they share the rest.
        let limit = self.machine.dram.queue + self.machine.dram.return_queue - (parts - 1);
        for k in 0..parts {
            let part = (self.turn[at] + k) % parts;
            let shared: usize = (0..parts).map(|p| self.slices[at * parts + p].credits.saturating_sub(1)).sum();
            let slice = &mut self.slices[at * parts + part];
            if slice.to_dram.is_empty() || (slice.credits > 0 && shared >= limit) {
                continue;
            }
            if let Some(request) = slice.to_dram.pop_front() {
                if request.wants_answer() {
                    slice.credits += 1;
                }
                self.delay[at].push_back((now + self.machine.dram.latency, request));
                self.turn[at] = (part + 1) % parts;
            }
            break;
        }
        if self.delay[at].front().is_some_and(|&(ready, _)| ready <= now)
            && !self.channels[at].full()
            && let Some((_, request)) = self.delay[at].pop_front()
        {
            let home = self.addresses.home(request.line);
            self.channels[at].push(request, home.bank, home.row);
        }
    }

    fn step_slice(&mut self, at: usize, now: u64) {
        if self.slices[at].idle() {
            self.intake(at, now);
            return;
        }
        self.answer(at, now);
        self.fill(at, now);
        let slice = &mut self.slices[at];
        if slice.to_dram.len() < self.machine.l2.queue
            && let Some(request) = slice.misses.pop_front()
        {
            slice.to_dram.push_back(request);
        }
        self.access(at, now);
        let slice = &mut self.slices[at];
        if slice.waiting.len() < self.machine.l2.queue
            && slice.delayed.front().is_some_and(|&(ready, _)| ready <= now)
            && let Some((_, request)) = slice.delayed.pop_front()
        {
            slice.waiting.push_back(request);
        }
        self.intake(at, now);
    }

    /// A packet arrives and starts to wait out the latency.
    fn intake(&mut self, at: usize, now: u64) {
        if self.slices[at].waiting.len() < self.machine.l2.queue
            && let Some(request) = self.down.pop(at, now)
        {
            self.slices[at].delayed.push_back((now + self.machine.l2.latency, request));
        }
    }

    /// One request whose line has come is answered.
    fn answer(&mut self, at: usize, now: u64) {
        if self.up.full(at) {
            return;
        }
        let slice = &mut self.slices[at];
        let Some(waiting) = slice.ready.front_mut() else { return };
        let request = waiting.pop_front();
        if waiting.is_empty() {
            slice.ready.pop_front();
            slice.under_way -= 1;
        }
        if let Some(request) = request
            && request.reads()
        {
            self.reply(at, request, now);
        }
    }

    fn reply(&mut self, at: usize, request: Request, now: u64) {
        let data = if request.reads() { LINE } else { 0 };
        let flits = self.flits(data);
        self.up.push(at, usize::from(request.sm), request, flits, now);
    }

    /// A request comes back from memory: a line fills the cache, the end of a write goes up.
    fn fill(&mut self, at: usize, now: u64) {
        let Some(&request) = self.slices[at].from_dram.front() else { return };
        if request.kind == Kind::Write {
            if !self.up.full(at) {
                self.slices[at].from_dram.pop_front();
                self.reply(at, request, now);
            }
            return;
        }
        if self.slices[at].fill_free > now {
            return;
        }
        let local = self.addresses.home(request.line).local;
        let slice = &mut self.slices[at];
        slice.from_dram.pop_front();
        slice.fill_free = now + LINE / self.machine.l2.port;
        if let Lookup::Pending(way) = slice.cache.look(local) {
            slice.cache.fill(way);
            let merged = std::mem::take(&mut slice.merged[way]);
            slice.ready.push_back(merged.into());
        }
    }

    /// One request looks itself up.
    fn access(&mut self, at: usize, now: u64) {
        let Some(&request) = self.slices[at].waiting.front() else { return };
        let l2 = &self.machine.l2;
        if self.slices[at].to_dram.len() >= l2.queue || self.up.full(at) || self.slices[at].port_free > now {
            return;
        }
        let local = self.addresses.home(request.line).local;
        let slice = &mut self.slices[at];
        let found = slice.cache.look(local);
        let accepted = match found {
            Lookup::Hit(way) => {
                slice.cache.touch(way, now);
                if request.writes() {
                    slice.cache.dirty(way);
                }
                slice.port_free = now + u64::from(request.bytes).div_ceil(l2.port);
                true
            }
            Lookup::Full => false,
            Lookup::Pending(way) | Lookup::Miss(way) => {
                let pending = matches!(found, Lookup::Pending(_));
                let room = if pending { slice.merged[way].len() < l2.merges } else { slice.under_way < l2.mshrs };
                // A write sends its data, wants its line and may push another out: up to three at once.
                let queue_room = if request.writes() { 2 } else { 1 };
                if !room || slice.misses.len() + queue_room >= l2.miss_queue {
                    false
                } else {
                    let wanted = if request.writes() {
                        slice.misses.push_back(request);
                        Request { kind: Kind::Allocate, bytes: LINE as u16, ..request }
                    } else {
                        request
                    };
                    if pending {
                        slice.cache.touch(way, now);
                    } else {
                        slice.misses.push_back(wanted);
                        slice.under_way += 1;
                        if let Some(line) = slice.cache.reserve(way, local, now) {
                            let line = self.addresses.line_of(at, line);
                            let spill = Request { kind: Kind::Spill, line, bytes: LINE as u16, ..request };
                            self.slices[at].misses.push_back(spill);
                            self.slices[at].port_free = now + LINE / self.machine.l2.port;
                        }
                    }
                    self.slices[at].merged[way].push(wanted);
                    true
                }
            }
        };
        if !accepted {
            self.counts.refused += 1;
            return;
        }
        self.slices[at].waiting.pop_front();
        if request.kind != Kind::Writeback {
            self.counts.accesses += 1;
            match found {
                Lookup::Hit(_) => {}
                Lookup::Pending(_) => self.counts.pending_hits += 1,
                _ => self.counts.misses += 1,
            }
        }
        if matches!(found, Lookup::Hit(_)) && request.wants_answer() {
            self.reply(at, request, now);
        }
    }
}
