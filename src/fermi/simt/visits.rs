//! Rays that go from queue to queue: taken, brought to their subtrees, and put back.

use super::LANES;
use super::batch::{Access, Batch, bits};
use super::layout::{LOAD, WORD, bytes};
use super::warp::{Phase, Warp};
use crate::fermi::blocks::RECORD_PART;
use crate::fermi::cut::Home;
use crate::fermi::kernel::Block;
use crate::fermi::launch::{Launch, Visit, Work};
use crate::layout::QueueEntry;

/// A ray that a lane holds.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Held<'a> {
    pub(super) ray: usize,
    /// Its entry in the queue.
    at: usize,
    /// All steps still to be taken.
    pub(super) rest: &'a [u32],
    /// How many of them belong to this stay.
    pub(super) own: usize,
    /// Node of the top tree at which it stands.
    pub(super) above: u32,
    /// The node above the next step is known without a climb.
    pub(super) descends: bool,
}

impl Held<'_> {
    /// Whether the next step is below a node higher up.
    pub(super) fn resumes(&self) -> bool {
        !self.descends && !self.rest.is_empty()
    }
}

/// What the lanes of a warp hold, and what they will take.
#[derive(Clone, Debug)]
pub(super) struct Stay<'a> {
    queue: &'a [Visit],
    /// Next entry of each lane, the end, and how far a lane's entries are apart.
    next: [usize; LANES],
    end: usize,
    stride: usize,
    pub(super) held: [Option<Held<'a>>; LANES],
}

impl<'a> Stay<'a> {
    /// Lanes that take entries of `range` in turn, the first of them after `offset`.
    pub(super) fn queued(queue: &'a [Visit], range: std::ops::Range<usize>, offset: usize, stride: usize) -> Stay<'a> {
        let next = std::array::from_fn(|lane| range.start + offset + lane);
        Stay { queue, next, end: range.end, stride, held: [None; LANES] }
    }

    /// Lanes with rays from `first` on that begin at the root of the top tree.
    pub(super) fn scheduled(launch: &Launch<'a>, first: usize, count: usize) -> Stay<'a> {
        let trace = launch.workload.trace;
        let is_top = |step: u32| launch.workload.cut.is_some_and(|cut| matches!(cut.home(step), Home::Top(_)));
        let mut held = [None; LANES];
        for (lane, ray) in held.iter_mut().zip(first..first + count) {
            let rest = trace.of(ray);
            let own = rest.iter().take_while(|&&step| is_top(step)).count();
            *lane = Some(Held { ray, at: ray, rest, own, above: 0, descends: true });
        }
        Stay { queue: &[], next: [0; LANES], end: 0, stride: 0, held }
    }
}

impl<'a> Warp<'a> {
    /// Lanes without a ray take the next of theirs, and all enter their subtrees.
    pub(super) fn take(&mut self, batch: &mut Batch) {
        let Some(mut stay) = self.stay.take() else { return };
        let charged = matches!(self.launch.work, Work::Visits { charged: true, .. });
        let mut taking = 0u32;
        for lane in 0..self.count {
            if stay.held[lane].is_none() && stay.next[lane] < stay.end {
                let (at, visit) = (stay.next[lane], stay.queue[stay.next[lane]]);
                let ray = visit.ray as usize;
                let (first, end) = (visit.steps.0 as usize, visit.steps.1 as usize);
                let rest = &self.launch.workload.trace.of(ray)[first..];
                stay.held[lane] = Some(Held { ray, at, rest, own: end - first, above: 0, descends: false });
                stay.next[lane] += stay.stride;
                taking |= 1 << lane;
            }
        }
        let holding = holding(&stay);
        if taking != 0 && charged {
            let of = |lane: usize| stay.held[lane].as_ref();
            let held = || bits(taking).filter_map(&of);
            batch.segment(Block::Take, taking);
            batch.access(Access::Load, held().map(|h| self.layout.queue(0, h.at)), bytes::<QueueEntry>());
            let parts: [&dyn Fn(usize) -> u64; 4] = [
                &|ray| self.layout.ray(ray),
                &|ray| self.layout.ray(ray) + LOAD,
                &|ray| self.layout.hit(ray),
                &|ray| self.layout.travel(ray),
            ];
            for part in &parts[..self.launch.kernel.record as usize / RECORD_PART] {
                batch.access(Access::Load, held().map(|h| part(h.ray)), LOAD);
            }
        }
        if holding == 0 {
            self.phase = if charged { Phase::Exit } else { Phase::Done };
        } else {
            self.enter(batch, &mut stay, holding, charged);
            self.phase = Phase::Outer;
        }
        self.stay = Some(stay);
    }

    /// Each ray begins its subtree, with an empty stack.
    fn enter(&mut self, batch: &mut Batch, stay: &mut Stay<'a>, holding: u32, charged: bool) {
        let Some(cut) = self.launch.workload.cut else { return };
        let mut entered = [0u32; LANES];
        for lane in bits(holding) {
            let Some(held) = &mut stay.held[lane] else { continue };
            let Some(Home::Subtree(subtree)) = held.rest.first().map(|&step| cut.home(step)) else { continue };
            let here = held.rest[..held.own].iter().take_while(|&&step| cut.home(step) == Home::Subtree(subtree));
            let (steps, rest) = held.rest.split_at(here.count());
            (held.rest, held.own) = (rest, held.own - steps.len());
            (held.above, held.descends) = (cut.subtrees()[subtree as usize].parent, false);
            (self.lanes[lane].steps, self.lanes[lane].depth) = (steps, 0);
            entered[lane] = subtree;
        }
        if charged {
            batch.segment(Block::Enter, holding);
            batch.access(Access::Load, bits(holding).map(|lane| self.layout.subtree(entered[lane])), LOAD);
        } else {
            // All of the visit is this subtree: nothing is left to hold.
            stay.held = [None; LANES];
        }
    }

    /// After the walk: where next? Rays with a subtree of the same owner stay, all others are put back.
    pub(super) fn choose(&mut self, batch: &mut Batch, stay: &mut Stay<'a>) {
        let Some(cut) = self.launch.workload.cut else { return };
        let holding = holding(stay);
        let of = |stay: &Stay<'a>, lane: usize| stay.held[lane];
        let next = |held: &Held| match held.rest.first().map(|&step| cut.home(step)) {
            Some(Home::Subtree(subtree)) => Some(subtree),
            _ => None,
        };
        batch.segment(Block::Choose, holding);
        let subtrees =
            || bits(holding).filter_map(|lane| of(stay, lane).as_ref().and_then(next).map(|next| (lane, next)));
        let going = subtrees().fold(0u32, |mask, (lane, _)| mask | 1 << lane);
        if going != 0 {
            batch.segment(Block::Owner, going);
            batch.access(Access::Load, subtrees().map(|(_, subtree)| self.layout.subtree(subtree)), LOAD);
        }
        let leaving = bits(holding)
            .filter(|&lane| of(stay, lane).is_some_and(|held| held.own == 0))
            .fold(0u32, |mask, lane| mask | 1 << lane);
        if leaving == 0 {
            return;
        }
        let held = || bits(leaving).filter_map(|lane| of(stay, lane));
        batch.segment(Block::Store, leaving);
        let entry = |h: Held| self.layout.queue(0, h.at);
        match self.launch.work {
            Work::Schedule => batch.access(Access::Store, held().map(entry), bytes::<QueueEntry>()),
            _ => batch.access(Access::Store, held().map(|h| entry(h) + WORD), WORD),
        }
        let parts: [&dyn Fn(usize) -> u64; 2] = [&|ray| self.layout.hit(ray), &|ray| self.layout.travel(ray)];
        for part in &parts[..self.launch.kernel.record as usize / (2 * RECORD_PART)] {
            batch.access(Access::Store, held().map(|h| part(h.ray)), LOAD);
        }
        bits(leaving).for_each(|lane| stay.held[lane] = None);
    }
}

/// Lanes that hold a ray.
pub(super) fn holding(stay: &Stay) -> u32 {
    stay.held.iter().enumerate().fold(0, |mask, (lane, held)| mask | u32::from(held.is_some()) << lane)
}
