//! Load unit and L1: memory instructions in order, one line a cycle, and what comes back.

use super::issue::CODE;
use super::{Program, Sm};
use crate::fermi::cache::Lookup;
use crate::fermi::cycles::memory::{Kind, Memory, Request};
use crate::fermi::machine::{LINE, Machine};
use crate::fermi::simt::Access;

/// A load whose lines are coming.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Load {
    pub(super) slot: u32,
    pub(super) register: u8,
    pub(super) pending: u32,
}

/// A memory instruction in the load pipeline.
#[derive(Clone, Copy, Debug)]
pub(super) struct Queued {
    pub(super) access: Access,
    pub(super) slot: u32,
    pub(super) load: u32,
    pub(super) left: u32,
    pub(super) bytes: u8,
    pub(super) moved: u16,
    pub(super) arrives: u64,
    /// Its first line has been accessed.
    pub(super) begun: bool,
}

impl Sm<'_> {
    /// One served load a cycle goes to the registers; it was a miss, so that is a replay.
    pub(super) fn write_back(&mut self, machine: &Machine, now: u64, program: &Program) {
        if let Some(load) = self.write_back.take() {
            self.replay(machine, self.loads[load as usize].slot);
            self.serve(load, now, program);
        }
        if let Some(served) = self.served.front_mut() {
            self.write_back = served.pop_front();
            if served.is_empty() {
                self.served.pop_front();
                self.under_way -= 1;
                self.stuck = false;
            }
        }
    }

    /// The scheduler of a warp loses its next issue to a memory instruction of the warp that is issued again.
    fn replay(&mut self, machine: &Machine, slot: u32) {
        if machine.sm.replay {
            let schedulers = self.order.len();
            self.replays[slot as usize % schedulers] += 1;
        }
    }

    /// One line of a load is there; the last makes its register readable.
    pub(super) fn serve(&mut self, load: u32, now: u64, program: &Program) {
        let state = &mut self.loads[load as usize];
        state.pending -= 1;
        if state.pending > 0 {
            return;
        }
        let (slot, register) = (state.slot as usize, usize::from(state.register));
        self.free_loads.push(load);
        if let Some(warp) = &mut self.warps[slot] {
            warp.ready[register] = now;
            self.wakes[slot] = warp.next_issue(program);
        }
    }

    /// A packet from outside: a line fills the L1, an acknowledgement lets its warp end.
    pub(super) fn respond(&mut self, machine: &Machine, program: &Program, memory: &mut Memory, now: u64) -> bool {
        let mut finished = false;
        if let Some(request) = self.arrived.take() {
            if request.kind == Kind::Write {
                let slot = usize::from(request.warp);
                if let Some(warp) = &mut self.warps[slot] {
                    warp.stores -= 1;
                }
                finished = self.retire(slot);
            } else if request.kind == Kind::Fetch {
                self.fetched(machine, program, (request.line - CODE) as usize, now);
            } else {
                self.latency.0 += now - request.sent;
                self.latency.1 += 1;
                if let Lookup::Pending(way) = self.cache.look_in(self.caches.of(request.line), request.line) {
                    self.cache.fill(way);
                    self.stuck = false;
                    self.served.push_back(std::mem::take(&mut self.merged[way]).into());
                } else {
                    self.sampled(&request, now, program);
                }
            }
        }
        self.arrived = memory.up.pop(usize::from(self.id), now);
        finished
    }

    /// The oldest memory instruction accesses one line of the L1. All but its first access are replays.
    pub(super) fn access(&mut self, machine: &Machine, program: &Program, now: u64) {
        let Some(&op) = self.queue.front() else { return };
        if op.arrives > now {
            return;
        }
        if self.stuck {
            self.counts.refused += 1;
            return;
        }
        let Some(&line) = self.lines.front() else { return };
        let found = self.cache.look_in(self.caches.of(line), line);
        let accepted = if op.access.writes() {
            self.store(machine, op, line, found, now)
        } else {
            self.load(machine, program, op, line, found, now)
        };
        if !accepted {
            self.stuck = true;
            self.counts.refused += 1;
            return;
        }
        self.counts.accesses += 1;
        match found {
            Lookup::Pending(_) if op.access.writes() => self.counts.misses += 1,
            Lookup::Pending(_) => self.counts.pending_hits += 1,
            Lookup::Hit(_) if op.access != Access::Store => {}
            _ => self.counts.misses += 1,
        }
        self.lines.pop_front();
        if let Some(front) = self.queue.front_mut() {
            front.left -= 1;
            front.begun = true;
            if front.left == 0 {
                self.queue.pop_front();
            }
            if op.begun {
                self.replay(machine, op.slot);
            }
        }
    }

    pub(super) fn load(
        &mut self,
        machine: &Machine,
        program: &Program,
        op: Queued,
        line: u64,
        found: Lookup,
        now: u64,
    ) -> bool {
        match found {
            Lookup::Hit(way) => {
                self.cache.touch(way, now);
                self.serve(op.load, now, program);
                true
            }
            Lookup::Pending(way) => {
                if self.merged[way].len() >= machine.l1.merges || self.misses.len() + 1 >= machine.l1.miss_queue {
                    return false;
                }
                self.cache.touch(way, now);
                self.merged[way].push(op.load);
                true
            }
            Lookup::Miss(way) => {
                if self.under_way >= machine.l1.mshrs || self.misses.len() + 1 >= machine.l1.miss_queue {
                    return false;
                }
                self.under_way += 1;
                let replaced = self.cache.reserve(way, line, now);
                self.merged[way].push(op.load);
                self.misses.push_back(self.request(Kind::Read, line, LINE as u16, op.slot, now));
                if let Some(line) = replaced {
                    self.misses.push_back(self.request(Kind::Writeback, line, LINE as u16, op.slot, now));
                }
                true
            }
            Lookup::Full => false,
        }
    }

    /// Local stores write back where they hit; all others write past the L1, and global ones evict.
    pub(super) fn store(&mut self, machine: &Machine, op: Queued, line: u64, found: Lookup, now: u64) -> bool {
        if let (Lookup::Hit(way), Access::Push) = (found, op.access) {
            self.cache.touch(way, now);
            self.cache.dirty(way);
            if let Some(warp) = &mut self.warps[op.slot as usize] {
                warp.stores -= 1;
            }
            return true;
        }
        if found == Lookup::Full || self.misses.len() >= machine.l1.miss_queue {
            return false;
        }
        if let Lookup::Hit(way) = found {
            self.cache.evict(way);
        }
        self.misses.push_back(self.request(Kind::Write, line, u16::from(op.bytes), op.slot, now));
        true
    }

    pub(super) fn request(&self, kind: Kind, line: u64, bytes: u16, slot: u32, now: u64) -> Request {
        Request { kind, line, bytes, sm: self.id, warp: slot as u16, sent: now }
    }
}
