//! A multiprocessor: warps, schedulers, arithmetic units, load unit and L1.

mod issue;
mod load_unit;
mod resident;
mod texture;

use std::collections::VecDeque;

use issue::{CodeLine, LINE_INSTRUCTIONS};
use load_unit::{Load, Queued};
use resident::Resident;
use texture::Texture;

use super::memory::{Memory, Request};
use crate::fermi::cache::Cache;
use crate::fermi::kernel::{Block, Instruction};
use crate::fermi::launch::Launch;
use crate::fermi::machine::{Machine, Timing};
use crate::fermi::result::{Counts, CpiStack, Instructions};
use crate::fermi::simt::{Batch, LANES, Layout, Warp};

/// A cycle that never comes.
const NEVER: u64 = u64::MAX;

/// The kernel as multiprocessors run it.
#[derive(Debug)]
pub struct Program {
    /// All instructions.
    pub code: Vec<Instruction>,
    /// Timing of each; memory instructions have none.
    pub timing: Vec<Option<Timing>>,
    /// Where each block starts, and the end.
    pub starts: [u32; Block::ALL.len() + 1],
    /// Registers named, and none.
    pub registers: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stall {
    Idle,
    ComputeData,
    ComputeStructural,
    MemoryData,
    MemoryStructural,
}

/// Which first-level cache a line is looked for in.
#[derive(Clone, Copy, Debug)]
pub struct Caches<'a> {
    /// The launch.
    pub launch: &'a Launch<'a>,
    /// Where things lie.
    pub layout: Layout,
}

impl Caches<'_> {
    fn of(&self, line: u64) -> u32 {
        match self.launch.virtual_caches {
            true => self.layout.virtual_cache(&self.launch.workload, line),
            false => 0,
        }
    }
}

/// A multiprocessor.
#[derive(Debug)]
pub struct Sm<'a> {
    id: u16,
    warps: Vec<Option<Box<Resident<'a>>>>,
    /// Cycle from which the next instruction of each slot can issue, as far as is known.
    wakes: Vec<u64>,
    /// Warps of each resident block that have not finished.
    blocks: Vec<u32>,
    /// Slots of each scheduler, oldest first, and the one that issued last.
    order: Vec<Vec<usize>>,
    last: Vec<Option<usize>>,
    sp_free: Vec<u64>,
    sfu_free: u64,
    fetch_free: u64,
    /// Which lines of code are here. All of a traversal kernel fit the instruction cache, so they stay.
    code: Vec<CodeLine>,
    loads: Vec<Load>,
    free_loads: Vec<u32>,
    queue: VecDeque<Queued>,
    lines: VecDeque<u64>,
    /// The oldest access was refused, and nothing has changed since that could let it through.
    stuck: bool,
    texture: Texture,
    /// Issues that each scheduler loses to memory instructions issued again.
    replays: Vec<u32>,
    cache: Cache,
    caches: Caches<'a>,
    merged: Vec<Vec<u32>>,
    under_way: usize,
    misses: VecDeque<Request>,
    /// Lines that came, whose loads are being served.
    served: VecDeque<VecDeque<u32>>,
    write_back: Option<u32>,
    arrived: Option<Request>,
    /// Next cycle in which something happens without a packet from outside.
    wake: u64,
    stepped: u64,
    stall: Stall,
    /// Accesses of the L1.
    pub counts: Counts,
    /// Accesses of the texture cache.
    pub texture_counts: Counts,
    /// Instructions issued.
    pub instructions: Instructions,
    /// Cycles by cause.
    pub cpi: CpiStack,
    /// Node and leaf visits of warps.
    pub visits: u64,
    /// Sum and number of the latencies of lines fetched.
    pub latency: (u64, u64),
}

impl<'a> Sm<'a> {
    /// An empty multiprocessor with room for `blocks` blocks of `warps` warps, in cycle `now`.
    pub fn new(id: usize, machine: &Machine, (blocks, warps): (usize, usize), caches: Caches<'a>, now: u64) -> Sm<'a> {
        let cache = Cache::new(machine.l1.sets(), machine.l1.ways, machine.l1.mapping).times(caches.launch.caches());
        let schedulers = machine.sm.schedulers as usize;
        Sm {
            id: id as u16,
            warps: (0..blocks * warps).map(|_| None).collect(),
            wakes: vec![NEVER; blocks * warps],
            blocks: vec![0; blocks],
            order: vec![Vec::new(); schedulers],
            last: vec![None; schedulers],
            sp_free: vec![0; machine.sm.sp_units as usize],
            sfu_free: 0,
            fetch_free: 0,
            code: Vec::new(),
            loads: Vec::new(),
            free_loads: Vec::new(),
            queue: VecDeque::new(),
            lines: VecDeque::new(),
            stuck: false,
            texture: Texture::new(machine),
            replays: vec![0; schedulers],
            merged: vec![Vec::new(); cache.lines()],
            cache,
            caches,
            under_way: 0,
            misses: VecDeque::new(),
            served: VecDeque::new(),
            write_back: None,
            arrived: None,
            wake: now,
            stepped: now,
            stall: Stall::Idle,
            counts: Counts::default(),
            texture_counts: Counts::default(),
            instructions: Instructions::default(),
            cpi: CpiStack::default(),
            visits: 0,
            latency: (0, 0),
        }
    }

    /// A slot without a block.
    pub fn free_block(&self) -> Option<usize> {
        self.blocks.iter().position(|&warps| warps == 0)
    }

    /// Whether no block is resident.
    pub fn empty(&self) -> bool {
        self.blocks.iter().all(|&warps| warps == 0)
    }

    /// Takes a block into `slot`.
    pub fn launch(&mut self, machine: &Machine, slot: usize, warps: Vec<Warp<'a>>, program: &Program, now: u64) {
        let per_block = self.warps.len() / self.blocks.len();
        self.blocks[slot] = warps.len() as u32;
        for (i, run) in warps.into_iter().enumerate() {
            let at = slot * per_block + i;
            let mut warp = Box::new(Resident {
                run,
                batch: Batch::default(),
                segment: 0,
                pc: 0,
                end: 0,
                memory: 0,
                lanes: 0,
                ready: vec![0; program.registers],
                fetched: 0,
                fetch_ready: 0,
                stores: 0,
                exited: false,
                block: slot,
            });
            warp.run.advance(&mut warp.batch);
            warp.enter(program);
            self.code.resize(program.code.len().div_ceil(LINE_INSTRUCTIONS), CodeLine::Missing);
            self.fetch(machine, &mut warp, now, now);
            self.wakes[at] = warp.fetch_ready;
            let scheduler = at % self.order.len();
            self.warps[at] = Some(warp);
            self.order[scheduler].retain(|&other| other != at);
            self.order[scheduler].push(at);
        }
        self.wake = now;
    }

    /// Whether there is something to do in cycle `now`.
    pub fn due(&self, memory: &Memory, now: u64) -> bool {
        now >= self.wake || memory.up.top(usize::from(self.id), now).is_some()
    }

    /// Next cycle in which something happens without a packet from outside.
    pub fn next(&self) -> u64 {
        self.wake
    }

    /// Charges the cycles up to `now` in which nothing happened.
    pub fn settle(&mut self, now: u64) {
        let skipped = now.saturating_sub(self.stepped + 1);
        self.charge(self.stall, skipped as f64);
        self.counts.refused += if self.stuck { skipped } else { 0 };
        self.stepped = now.saturating_sub(1).max(self.stepped);
    }

    fn charge(&mut self, stall: Stall, cycles: f64) {
        *match stall {
            Stall::Idle => &mut self.cpi.idle,
            Stall::ComputeData => &mut self.cpi.compute_data,
            Stall::ComputeStructural => &mut self.cpi.compute_structural,
            Stall::MemoryData => &mut self.cpi.memory_data,
            Stall::MemoryStructural => &mut self.cpi.memory_structural,
        } += cycles;
    }

    /// One cycle. Returns whether a block finished.
    pub fn step(&mut self, machine: &Machine, program: &Program, memory: &mut Memory, now: u64) -> bool {
        self.settle(now);
        self.stepped = now;
        self.write_back(machine, now, program);
        let mut finished = self.respond(machine, program, memory, now);
        if !self.misses.is_empty()
            && !memory.full(usize::from(self.id))
            && let Some(request) = self.misses.pop_front()
        {
            memory.send(request, now);
            self.stuck = false;
        }
        self.access(machine, program, now);
        self.sample(machine, program, now);
        // A scheduler that loses its issue to a replay keeps back warps that could issue in the next cycle.
        let replaying = self.replays.iter().any(|&lost| lost > 0);
        let (issued, blocked) = self.issue(machine, program, now);
        finished |= issued.2;
        if issued.0 > 0 {
            let share = f64::from(issued.1) / f64::from(issued.0 * LANES as u32);
            self.cpi.base += share;
            self.cpi.divergence += 1.0 - share;
        }
        // Where the load pipeline is stuck, warps that want it wait for a packet from outside like those that wait
        // for loads.
        let blocked_for_now = blocked.is_some_and(|stall| stall != Stall::MemoryStructural || !self.stuck);
        let busy = blocked_for_now
            || !self.queue.is_empty() && !self.stuck
            || !self.texture.queue.is_empty()
            || replaying
            || !self.misses.is_empty()
            || !self.served.is_empty()
            || self.write_back.is_some()
            || self.arrived.is_some();
        self.wake = now + 1;
        if issued.0 == 0 || !busy {
            let earliest = self.earliest();
            self.stall = match blocked {
                Some(stall) => stall,
                None if self.empty() => Stall::Idle,
                None if earliest == NEVER => Stall::MemoryData,
                None => Stall::ComputeData,
            };
            if issued.0 == 0 {
                self.charge(self.stall, 1.0);
            }
            if !busy {
                let next = if blocked.is_some() && issued.0 == 0 { self.earliest_after(now) } else { earliest };
                self.wake = next.max(now + 1);
            }
        }
        finished
    }

    /// First cycle in which a warp can issue.
    fn earliest(&self) -> u64 {
        self.wakes.iter().copied().min().unwrap_or(NEVER)
    }

    /// First cycle after `now` in which a warp can issue that cannot yet.
    fn earliest_after(&self, now: u64) -> u64 {
        self.wakes.iter().copied().filter(|&wake| wake > now).min().unwrap_or(NEVER)
    }

    /// Frees a warp that has exited and whose stores are done. Returns whether its block is done.
    fn retire(&mut self, slot: usize) -> bool {
        let Some(warp) = &self.warps[slot] else { return false };
        if !warp.exited || warp.stores > 0 {
            return false;
        }
        let block = warp.block;
        self.warps[slot] = None;
        let scheduler = slot % self.order.len();
        self.order[scheduler].retain(|&other| other != slot);
        self.blocks[block] -= 1;
        self.blocks[block] == 0
    }
}
