//! A memory channel: banks with open rows, one command a cycle, first-ready first-come first-served.

use std::collections::VecDeque;

use super::memory::Request;
use crate::fermi::machine::Dram;

/// Requests on their way to the scheduler at most.
const INTAKE: usize = 2;

/// A request as the channel sees it.
#[derive(Clone, Copy, Debug)]
struct Job {
    request: Request,
    bank: usize,
    row: u64,
    /// Bytes whose burst was commanded.
    sent: u64,
    /// Bytes whose data passed.
    done: u64,
}

#[derive(Clone, Debug, Default)]
struct Bank {
    open: Option<u64>,
    row: u64,
    job: Option<Job>,
    /// Waiting requests, oldest first.
    waiting: VecDeque<Job>,
    /// Row whose requests go first, while there are any.
    favoured: Option<u64>,
    may_read: u64,
    may_precharge: u64,
    may_activate: u64,
}

/// A channel. Time is in its own cycles.
#[derive(Clone, Debug)]
pub struct Channel {
    timing: Dram,
    banks: Vec<Bank>,
    /// Banks with a job, and with waiting requests, a bit each.
    busy_banks: u64,
    queued: u64,
    /// Bank that is served first.
    first: usize,
    intake: VecDeque<Job>,
    waiting: usize,
    busy: usize,
    /// Bursts under way: when their data passes, and whose they are.
    bursts: VecDeque<(u64, Job)>,
    returned: VecDeque<Request>,
    group_free: Vec<u64>,
    group_precharge: Vec<u64>,
    column_free: u64,
    activate_free: u64,
    read_free: u64,
    write_free: u64,
    now: u64,
}

impl Channel {
    /// An idle channel.
    pub fn new(timing: &Dram) -> Channel {
        Channel {
            banks: vec![Bank::default(); timing.banks as usize],
            busy_banks: 0,
            queued: 0,
            first: 0,
            intake: VecDeque::new(),
            waiting: 0,
            busy: 0,
            bursts: VecDeque::new(),
            returned: VecDeque::new(),
            group_free: vec![0; timing.groups as usize],
            group_precharge: vec![0; timing.groups as usize],
            column_free: 0,
            activate_free: 0,
            read_free: 0,
            write_free: 0,
            now: 0,
            timing: timing.clone(),
        }
    }

    /// Whether the scheduler takes no more.
    pub fn full(&self) -> bool {
        self.waiting >= self.timing.queue || self.intake.len() >= INTAKE
    }

    /// Whether nothing is under way.
    pub fn idle(&self) -> bool {
        self.busy == 0 && self.returned.is_empty()
    }

    /// Takes a request for `row` of `bank`.
    pub fn push(&mut self, request: Request, bank: usize, row: u64) {
        self.busy += 1;
        self.intake.push_back(Job { request, bank, row, sent: 0, done: 0 });
    }

    /// The oldest finished request.
    pub fn top(&self) -> Option<&Request> {
        self.returned.front()
    }

    /// Takes the oldest finished request.
    pub fn pop(&mut self) -> Option<Request> {
        self.returned.pop_front()
    }

    /// Lets `cycles` pass.
    pub fn skip(&mut self, cycles: u64) {
        self.now += cycles;
    }

    /// One cycle.
    pub fn step(&mut self) {
        self.now += 1;
        if self.busy == 0 {
            return;
        }
        self.transfer();
        self.schedule();
        self.command();
    }

    /// Data of one burst passes.
    fn transfer(&mut self) {
        if self.returned.len() >= self.timing.return_queue {
            return;
        }
        if self.bursts.front().is_none_or(|&(at, _)| at > self.now) {
            return;
        }
        if let Some((_, job)) = self.bursts.pop_front() {
            // A request's bursts follow each other, so its last is the one that ends it.
            if job.done >= u64::from(job.request.bytes) {
                self.busy -= 1;
                if job.request.wants_answer() {
                    self.returned.push_back(job.request);
                }
            }
        }
    }

    /// Requests come in, and one idle bank takes its next: the oldest to its favoured row, or the oldest.
    fn schedule(&mut self) {
        while self.waiting < self.timing.queue {
            let Some(job) = self.intake.pop_front() else { break };
            self.queued |= 1 << job.bank;
            self.banks[job.bank].waiting.push_back(job);
            self.waiting += 1;
        }
        if let Some(at) = self.in_turn(self.queued & !self.busy_banks).next() {
            let bank = &mut self.banks[at];
            let row = bank.favoured.unwrap_or(bank.row);
            let chosen = bank.waiting.iter().position(|job| job.row == row).unwrap_or(0);
            if let Some(job) = bank.waiting.remove(chosen) {
                bank.favoured = bank.waiting.iter().any(|other| other.row == job.row).then_some(job.row);
                bank.job = Some(job);
                self.busy_banks |= 1 << at;
                if bank.waiting.is_empty() {
                    self.queued &= !(1 << at);
                }
                self.waiting -= 1;
                self.first = (self.first + 1) % self.banks.len();
            }
        }
    }

    /// Issues one command to the first bank that can take one.
    fn command(&mut self) {
        for at in self.in_turn(self.busy_banks) {
            if self.command_bank(at) {
                break;
            }
        }
    }

    /// Banks of `set`, the one that is served first at the head.
    fn in_turn(&self, set: u64) -> impl Iterator<Item = usize> + use<> {
        let first = self.first;
        let (from_first, before) = (set >> first << first, set & ((1 << first) - 1));
        bits(from_first).chain(bits(before))
    }

    fn command_bank(&mut self, at: usize) -> bool {
        let (t, now) = (&self.timing, self.now);
        let group = at / (self.banks.len() / self.group_free.len());
        let bank = &mut self.banks[at];
        let Some(job) = &mut bank.job else { return false };
        let writes = job.request.writes();
        let direction_free = if writes { self.write_free } else { self.read_free };
        if bank.open == Some(job.row) {
            if now < bank.may_read.max(self.column_free).max(self.group_free[group]).max(direction_free) {
                return false;
            }
            job.sent += t.burst;
            job.done = job.sent;
            let delay = if writes { t.wl } else { t.cl };
            let length = t.ccd;
            self.bursts.push_back((now + delay, *job));
            self.column_free = now + t.ccd;
            self.group_free[group] = now + t.ccdl;
            if writes {
                self.read_free = now + t.wl + length + t.cdlr;
                bank.may_precharge = bank.may_precharge.max(now + t.wl + length + t.wr);
            } else {
                self.write_free = now + (t.cl + length + 2).saturating_sub(t.wl);
                bank.may_precharge = bank.may_precharge.max(now + length);
                self.group_precharge[group] = now + t.rtpl;
            }
            if job.sent >= u64::from(job.request.bytes) {
                bank.job = None;
                self.busy_banks &= !(1 << at);
            }
            true
        } else if bank.open.is_none() {
            if now < bank.may_activate.max(self.activate_free) {
                return false;
            }
            bank.open = Some(job.row);
            bank.row = job.row;
            self.activate_free = now + t.rrd;
            bank.may_read = now + t.rcd;
            bank.may_precharge = now + t.ras;
            bank.may_activate = now + t.rc;
            self.first = (at + 1) % self.banks.len();
            true
        } else {
            if now < bank.may_precharge.max(self.group_precharge[group]) {
                return false;
            }
            bank.open = None;
            bank.may_activate = bank.may_activate.max(now + t.rp);
            self.first = (at + 1) % self.banks.len();
            true
        }
    }
}

/// Indices of the bits set.
fn bits(mut set: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = set.trailing_zeros();
        set &= set.wrapping_sub(1);
        (bit < u64::BITS).then_some(bit as usize)
    })
}
