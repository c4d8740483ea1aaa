//! Texture units: loads in order through a cache of their own, past the L1.

use std::collections::VecDeque;

use super::load_unit::Queued;
use super::{Program, Sm};
use crate::fermi::cache::{Cache, Lookup};
use crate::fermi::cycles::memory::{Kind, Request};
use crate::fermi::machine::{LINE, Machine};

/// The texture units of a multiprocessor. Misses under way have no limit: the hardware's fragment queue is deeper than
/// the loads that its warps can have under way.
#[derive(Debug)]
pub(super) struct Texture {
    pub(super) queue: VecDeque<Queued>,
    pub(super) lines: VecDeque<u64>,
    cache: Cache,
    /// Loads by line of the cache that is on its way.
    merged: Vec<Vec<u32>>,
    /// Cycle from which the units are free.
    free: u64,
}

impl Texture {
    pub(super) fn new(machine: &Machine) -> Texture {
        let cache = machine.texture.cache();
        let merged = vec![Vec::new(); cache.lines()];
        Texture { queue: VecDeque::new(), lines: VecDeque::new(), cache, merged, free: 0 }
    }
}

impl Sm<'_> {
    /// The oldest texture load accesses one line; with its last it holds the units until its texels have passed.
    pub(super) fn sample(&mut self, machine: &Machine, program: &Program, now: u64) {
        let unit = &mut self.texture;
        let Some(&op) = unit.queue.front() else { return };
        let Some(&line) = unit.lines.front() else { return };
        if op.arrives.max(unit.free) > now {
            return;
        }
        let found = unit.cache.look(line);
        match found {
            Lookup::Hit(way) => unit.cache.touch(way, now),
            Lookup::Pending(way) => {
                unit.cache.touch(way, now);
                unit.merged[way].push(op.load);
                self.texture_counts.pending_hits += 1;
            }
            Lookup::Miss(way) => {
                unit.cache.reserve(way, line, now);
                unit.merged[way].push(op.load);
                self.texture_counts.misses += 1;
                self.misses.push_back(self.request(Kind::Read, line, LINE as u16, op.slot, now));
            }
            Lookup::Full => return,
        }
        self.texture_counts.accesses += 1;
        let unit = &mut self.texture;
        unit.lines.pop_front();
        if let Some(op) = unit.queue.front_mut() {
            op.left -= 1;
            if op.left == 0 {
                unit.free = now + u64::from(op.moved).div_ceil(machine.texture.port).max(1);
                unit.queue.pop_front();
            }
        }
        if let Lookup::Hit(_) = found {
            self.serve(op.load, now, program);
        }
    }

    /// A line has come that the texture units may have asked for.
    pub(super) fn sampled(&mut self, request: &Request, now: u64, program: &Program) {
        if let Lookup::Pending(way) = self.texture.cache.look(request.line) {
            self.texture.cache.fill(way);
            for load in std::mem::take(&mut self.texture.merged[way]) {
                self.serve(load, now, program);
            }
        }
    }
}
