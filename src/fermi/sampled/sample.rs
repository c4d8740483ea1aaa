//! What the replayed multiprocessors did, and what the whole machine did for short whiles.

use rayon::prelude::*;

use super::design::{Asked, Design};
use super::timed;
use crate::Result;
use crate::fermi::caches::{self, Span};
use crate::fermi::launch::Launch;
use crate::fermi::machine::Machine;
use crate::fermi::result::Counts;
use crate::fermi::times::Times;

/// Glimpses of the whole machine at first, and as many at a time where they are too few.
pub(super) const GLIMPSES: usize = 4;

/// Most of a launch's misses of the L2 that glimpses may see: with what else a sample takes, a full replay of two passes
/// costs twice as much.
const GLIMPSED: f64 = 0.5;

/// Blocks that are replayed without company: it matters at the end of the launch only.
const BY_ITSELF: usize = 8;

/// A multiprocessor that was replayed by itself, with an even share of the L2: each of its blocks, and what it did.
#[derive(Clone, Debug)]
pub(super) struct Run {
    pub(super) blocks: Vec<usize>,
    pub(super) spans: Vec<Span>,
}

impl Run {
    /// What it asked of the L2, block by block; rays and hits, which always miss, tell nothing.
    fn course(&self) -> Vec<Asked> {
        let (mut accesses, mut misses) = (0.0, 0.0);
        let asked = |(&block, span): (&usize, &Span)| {
            accesses += span.reused.accesses as f64;
            misses += span.l2.misses as f64;
            Asked { block, accesses, misses }
        };
        self.blocks.iter().zip(&self.spans).map(asked).collect()
    }

    /// Cycles of some blocks without the others over their cycles in company.
    fn by_itself(&self, machine: &Machine, launch: &Launch) -> Result<f64> {
        let step = self.blocks.len().div_ceil(BY_ITSELF).max(1);
        let some: Vec<usize> = (0..self.blocks.len()).step_by(step).collect();
        let alone = |&block: &usize| Ok(caches::one(machine, launch, 0, &self.blocks[block..=block], false)?.cycles);
        let apart: Vec<f64> = some.par_iter().map(alone).collect::<Result<_>>()?;
        let together: f64 = some.iter().map(|&block| self.spans[block].cycles).sum();
        Ok(if together > 0.0 { (apart.iter().sum::<f64>() / together).min(1.0) } else { 1.0 })
    }
}

/// What was replayed so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Sample {
    pub(super) runs: Vec<Run>,
    /// What each block of the first does with the tree in the L2.
    pub(super) given: Vec<Span>,
    /// Accesses of the L2 for lines of the tree and of stacks in each glimpse.
    pub(super) glimpses: Vec<Counts>,
    /// Latencies under the load that the first multiprocessor causes together with others of its kind.
    pub(super) times: Option<Times>,
    /// Cycles of blocks that have a multiprocessor to themselves over those of the same blocks in company.
    pub(super) by_itself: f64,
    /// Seconds in which multiprocessors were replayed, one after the other.
    seconds: f64,
}

impl Sample {
    /// Replays multiprocessors until there are `sms`.
    pub(super) fn extend(&mut self, machine: &Machine, launch: &Launch, design: &Design, sms: usize) -> Result<()> {
        let replay = |sm| {
            let (blocks, mut seconds) = (design.blocks_of(sm), 0.0);
            let outcome = timed(&mut seconds, || caches::one(machine, launch, sm, &blocks, false))?;
            Ok((blocks, outcome, seconds))
        };
        let outcomes: Vec<_> = (self.runs.len()..sms).into_par_iter().map(replay).collect::<Result<_>>()?;
        for (blocks, outcome, seconds) in outcomes {
            let load = outcome.load().times(f64::from(machine.sms));
            self.times.get_or_insert_with(|| Times::unloaded(machine).with_queues(machine, &load));
            self.runs.push(Run { blocks, spans: outcome.spans });
            self.seconds += seconds;
        }
        Ok(())
    }

    /// Whether all but the first `glimpses` would see few of the misses of the L2 that the launch has: else they cost as much.
    pub(super) fn worth_looking(&self, machine: &Machine, glimpses: usize) -> bool {
        let seen = (glimpses - self.glimpses.len()) as u64 * caches::misses_of_glimpse(machine);
        let misses: u64 = self.runs.iter().flat_map(|run| &run.spans).map(|span| span.l2.misses).sum();
        seen as f64 <= GLIMPSED * misses as f64 / self.runs.len() as f64 * f64::from(machine.sms)
    }

    /// Glimpses until there are `glimpses`, where the first multiprocessor asked the L2 for most; and at first, what else
    /// is to be known of it.
    pub(super) fn look(&mut self, machine: &Machine, launch: &Launch, design: &Design, glimpses: usize) -> Result<()> {
        let (Some(first), Some(times)) = (self.runs.first(), self.times) else { return Ok(()) };
        let course = first.course();
        let before = caches::misses_before_glimpse(machine) as f64 / f64::from(machine.sms);
        let glimpse = |draw| caches::glimpse(machine, launch, design.glimpse(draw, &course, before), times);
        let look = || (self.glimpses.len()..glimpses).into_par_iter().map(glimpse).collect::<Result<Vec<_>>>();
        let new = if self.given.is_empty() {
            let given = || caches::one(machine, launch, 0, &first.blocks, true);
            let (given, (new, by_itself)) =
                rayon::join(given, || rayon::join(look, || first.by_itself(machine, launch)));
            (self.given, self.by_itself) = (given?.spans, by_itself?);
            new
        } else {
            look()
        };
        self.glimpses.extend(new?);
        Ok(())
    }

    /// Seconds of the full replay, by what was replayed: two passes over all multiprocessors.
    pub(super) fn full(&self, machine: &Machine) -> f64 {
        2.0 * self.seconds / self.runs.len() as f64 * f64::from(machine.sms)
    }
}
