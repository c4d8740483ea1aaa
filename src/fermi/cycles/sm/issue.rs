//! Fetch and issue: two schedulers, greedy then oldest, in order within a warp.

use super::load_unit::{Load, Queued};
use super::resident::Resident;
use super::{NEVER, Program, Sm, Stall};
use crate::fermi::cycles::memory::Kind;
use crate::fermi::kernel::Operation;
use crate::fermi::machine::{LINE, Machine, Unit};

/// Cycles that an instruction may wait for its unit in the operand collector's slots before issue stops.
const WAITING: u64 = 8;
/// Line number of the first line of code (GPGPU-Sim's PROGRAM_MEM_START).
pub(super) const CODE: u64 = 0xf000_0000 / LINE;
/// Instructions of a line of code: GPGPU-Sim takes 8 bytes for one of PTX.
pub(super) const LINE_INSTRUCTIONS: usize = 16;

/// A line of code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CodeLine {
    Missing,
    Coming,
    Here,
}

impl Sm<'_> {
    /// Each scheduler issues one instruction: of the warp that issued last if it can, else of the oldest that
    /// can. Returns instructions, lanes and whether a block finished; and what kept a ready warp from issuing.
    pub(super) fn issue(
        &mut self,
        machine: &Machine,
        program: &Program,
        now: u64,
    ) -> ((u32, u32, bool), Option<Stall>) {
        let mut issued = (0, 0, false);
        let mut blocked = None;
        for scheduler in 0..self.order.len() {
            if self.replays[scheduler] > 0 {
                self.replays[scheduler] -= 1;
                blocked = Some(Stall::MemoryStructural);
                continue;
            }
            let last = self.last[scheduler].filter(|&slot| self.wakes[slot] <= now);
            for position in 0..=self.order[scheduler].len() {
                let slot = match (position, last) {
                    (0, Some(slot)) => slot,
                    (0, None) => continue,
                    _ => self.order[scheduler][position - 1],
                };
                if self.wakes[slot] > now || (position > 0 && Some(slot) == last) {
                    continue;
                }
                match self.issue_warp(machine, program, slot, now) {
                    Ok((lanes, finished)) => {
                        self.last[scheduler] = Some(slot);
                        issued = (issued.0 + 1, issued.1 + u32::from(lanes), issued.2 | finished);
                        break;
                    }
                    Err(stall) if blocked != Some(Stall::ComputeStructural) => blocked = Some(stall),
                    Err(_) => {}
                }
            }
        }
        (issued, blocked)
    }

    pub(super) fn issue_warp(
        &mut self,
        machine: &Machine,
        program: &Program,
        slot: usize,
        now: u64,
    ) -> Result<(u8, bool), Stall> {
        let Some(warp) = &mut self.warps[slot] else { return Err(Stall::Idle) };
        let instruction = program.code[warp.pc];
        match program.timing[warp.pc] {
            Some(timing) => {
                // Units are reached after the operand collector, whose slots hold what has to wait.
                let reach = now + machine.sm.pipeline + machine.sm.collect(&instruction);
                let free = match timing.unit {
                    Unit::Sp => self.sp_free.iter_mut().min(),
                    Unit::Sfu => Some(&mut self.sfu_free),
                };
                let Some(free) = free else { return Err(Stall::ComputeStructural) };
                if *free > reach + WAITING {
                    return Err(Stall::ComputeStructural);
                }
                let start = reach.max(*free);
                *free = start + timing.interval;
                warp.ready[usize::from(instruction.destination)] = start + timing.latency;
            }
            None => {
                let texture = instruction.operation == Operation::Texture;
                if !texture && self.queue.len() >= machine.sm.load_queue {
                    return Err(Stall::MemoryStructural);
                }
                let op = warp.batch.memory[warp.memory];
                warp.memory += 1;
                let lines = &warp.batch.lines[op.lines.0 as usize..op.lines.1 as usize];
                let arrives = now + machine.load_latency(instruction.operation) + machine.sm.collect(&instruction);
                let mut load = 0;
                if matches!(instruction.operation, Operation::Load | Operation::Texture) {
                    let state =
                        Load { slot: slot as u32, register: instruction.destination, pending: lines.len() as u32 };
                    load = match self.free_loads.pop() {
                        Some(load) => {
                            self.loads[load as usize] = state;
                            load
                        }
                        None => {
                            self.loads.push(state);
                            self.loads.len() as u32 - 1
                        }
                    };
                    warp.ready[usize::from(instruction.destination)] = NEVER;
                } else {
                    warp.stores += lines.len() as u32;
                }
                let (queue, queued) = match texture {
                    true => (&mut self.texture.queue, &mut self.texture.lines),
                    false => (&mut self.queue, &mut self.lines),
                };
                queued.extend(lines);
                let left = lines.len() as u32;
                queue.push_back(Queued {
                    access: op.access,
                    slot: slot as u32,
                    load,
                    left,
                    bytes: op.bytes,
                    moved: op.moved,
                    arrives,
                    begun: false,
                });
            }
        }
        warp.ready[0] = 0;
        let lanes = warp.lanes;
        self.instructions.warp += 1;
        self.instructions.thread += u64::from(lanes);
        let next = warp.pc + 1;
        warp.pc = next;
        warp.fetched -= 1;
        if next == warp.end {
            match warp.segments_next(program) {
                Some(block) => self.visits += u64::from(block.visits()),
                None => {
                    warp.exited = true;
                    self.wakes[slot] = NEVER;
                    return Ok((lanes, self.retire(slot)));
                }
            }
        }
        // A jump is found out when the scheduler meets an instruction that does not follow: the one left in the
        // buffer, or the one fetched after it.
        let jumps = warp.pc != next;
        let request = match (jumps, warp.fetched) {
            (false, 0) => Some(now),
            (false, _) => None,
            (true, 0) => {
                self.fetch_free = self.fetch_free.max(now) + 1;
                Some(now + machine.sm.fetch_latency)
            }
            (true, _) => Some(now + 1),
        };
        if let Some(from) = request
            && let Some(mut warp) = self.warps[slot].take()
        {
            self.fetch(machine, &mut warp, from, now);
            self.warps[slot] = Some(warp);
        }
        if let Some(warp) = &self.warps[slot] {
            self.wakes[slot] = warp.next_issue(program).max(now + 1);
        }
        Ok((lanes, false))
    }
    /// Fetches the next instructions of `warp` in cycle `from` or as soon as the port is free; a line of code that is
    /// not here is sent for, and the warp waits.
    pub(super) fn fetch(&mut self, machine: &Machine, warp: &mut Resident, from: u64, now: u64) {
        let start = from.max(self.fetch_free);
        self.fetch_free = start + 1;
        warp.fetched = machine.sm.fetch;
        warp.fetch_ready = start + machine.sm.fetch_latency;
        let line = warp.pc / LINE_INSTRUCTIONS;
        if self.code[line] == CodeLine::Here {
            return;
        }
        warp.fetch_ready = NEVER;
        if self.code[line] == CodeLine::Missing {
            self.code[line] = CodeLine::Coming;
            self.misses.push_back(self.request(Kind::Fetch, CODE + line as u64, LINE as u16, 0, now));
        }
    }

    /// A line of code has come: warps that wait for it go on.
    pub(super) fn fetched(&mut self, machine: &Machine, program: &Program, line: usize, now: u64) {
        self.code[line] = CodeLine::Here;
        for (slot, warp) in self.warps.iter_mut().enumerate() {
            if let Some(warp) = warp
                && warp.fetch_ready == NEVER
                && warp.pc / LINE_INSTRUCTIONS == line
            {
                warp.fetch_ready = now + machine.sm.fetch_latency;
                self.wakes[slot] = warp.next_issue(program);
            }
        }
    }
}
