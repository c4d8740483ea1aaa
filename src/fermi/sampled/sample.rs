//! What the replayed multiprocessors did, and what the whole machine did for short whiles.

use rayon::prelude::*;

use super::design::Design;
use super::timed;
use crate::Result;
use crate::fermi::caches::{self, Span};
use crate::fermi::launch::Launch;
use crate::fermi::machine::Machine;
use crate::fermi::result::Counts;
use crate::fermi::times::Times;

/// Glimpses of the whole machine with the first multiprocessor. Where a launch has few accesses of the L2, most of them
/// miss, so rates are skewed, and with five glimpses Student's interval holds too rarely.
const FIRST_GLIMPSES: usize = 8;

/// Glimpses with each further multiprocessor: what they tell matters less than what it does itself.
const FURTHER_GLIMPSES: usize = 1;

/// Most of a launch's misses of the L2 that glimpses may see: with what else a sample takes, a full replay of two passes
/// costs twice as much.
const GLIMPSED: f64 = 0.5;

/// Blocks that are replayed without company: it matters at the end of the launch only.
const BY_ITSELF: usize = 8;

/// A multiprocessor that was replayed by itself: each of its blocks, and what it did.
#[derive(Clone, Debug)]
pub(super) struct Run {
    pub(super) blocks: Vec<usize>,
    /// With an even share of the L2.
    pub(super) even: Vec<Span>,
    /// With the tree in the L2.
    pub(super) given: Vec<Span>,
}

/// What was replayed so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Sample {
    pub(super) runs: Vec<Run>,
    /// Accesses of the L2 in each glimpse, and those of them for lines of the tree.
    pub(super) glimpses: Vec<[Counts; 2]>,
    /// Latencies under the load that the first multiprocessor causes together with others of its kind.
    pub(super) times: Option<Times>,
    /// Cycles of blocks that have a multiprocessor to themselves over those of the same blocks in company.
    pub(super) by_itself: f64,
    /// Seconds in which they were replayed, one after the other.
    seconds: f64,
}

impl Sample {
    /// Replays multiprocessors until there are `sms`.
    pub(super) fn extend(&mut self, machine: &Machine, launch: &Launch, design: &Design, sms: usize) -> Result<()> {
        let jobs: Vec<(usize, bool)> = (self.runs.len()..sms).flat_map(|sm| [(sm, false), (sm, true)]).collect();
        let replay = |(sm, given)| {
            let mut seconds = 0.0;
            let outcome = timed(&mut seconds, || caches::one(machine, launch, sm, &design.blocks_of(sm), given));
            outcome.map(|outcome| (outcome, seconds))
        };
        let outcomes: Vec<_> = jobs.into_par_iter().map(replay).collect::<Result<_>>()?;
        self.seconds += outcomes.iter().map(|(_, seconds)| seconds).sum::<f64>();
        let mut outcomes = outcomes.into_iter().map(|(outcome, _)| outcome);
        while let (Some(even), Some(given)) = (outcomes.next(), outcomes.next()) {
            let load = even.load().times(f64::from(machine.sms));
            self.times.get_or_insert_with(|| Times::unloaded(machine).with_queues(machine, &load));
            let blocks = design.blocks_of(self.runs.len());
            self.runs.push(Run { blocks, even: even.spans, given: given.spans });
        }
        if self.by_itself == 0.0 { self.separate(machine, launch) } else { Ok(()) }
    }

    fn wanted(&self) -> usize {
        FIRST_GLIMPSES + FURTHER_GLIMPSES * self.runs.len().saturating_sub(1)
    }

    /// Whether the glimpses still wanted see few of the misses of the L2 that the launch has: else they cost as much.
    pub(super) fn worth_looking(&self, machine: &Machine) -> bool {
        let seen = (self.wanted() - self.glimpses.len()) as u64 * caches::misses_of_glimpse(machine);
        let misses: u64 = self.runs.iter().flat_map(|run| &run.even).map(|span| span.l2.misses).sum();
        seen as f64 <= GLIMPSED * misses as f64 / self.runs.len() as f64 * f64::from(machine.sms)
    }

    /// Some blocks of the first multiprocessor without the others.
    fn separate(&mut self, machine: &Machine, launch: &Launch) -> Result<()> {
        let Some(first) = self.runs.first() else { return Ok(()) };
        let some = || (0..first.blocks.len()).step_by(first.blocks.len().div_ceil(BY_ITSELF).max(1));
        let alone = |block: usize| Ok(caches::one(machine, launch, 0, &first.blocks[block..=block], false)?.cycles);
        let apart: f64 = some().map(alone).sum::<Result<f64>>()?;
        let together: f64 = some().map(|block| first.even[block].cycles).sum();
        self.by_itself = if together > 0.0 { (apart / together).min(1.0) } else { 1.0 };
        Ok(())
    }

    /// Glimpses where the first multiprocessor asked for most of the L2.
    pub(super) fn look(&mut self, machine: &Machine, launch: &Launch, design: &Design) -> Result<()> {
        let (Some(first), Some(times)) = (self.runs.first(), self.times) else { return Ok(()) };
        let mut sum = 0.0;
        let weights: Vec<(usize, f64)> = first
            .blocks
            .iter()
            .zip(&first.even)
            .map(|(&block, span)| {
                sum += span.l2.accesses as f64;
                (block, sum)
            })
            .collect();
        let look = |draw| caches::glimpse(machine, launch, design.glimpse(draw, &weights), times);
        let new: Vec<[Counts; 2]> =
            (self.glimpses.len()..self.wanted()).into_par_iter().map(look).collect::<Result<_>>()?;
        self.glimpses.extend(new);
        Ok(())
    }

    /// Seconds of the full replay, by what was replayed: two passes, as each multiprocessor took.
    pub(super) fn full(&self, machine: &Machine) -> f64 {
        self.seconds / self.runs.len() as f64 * f64::from(machine.sms)
    }
}
