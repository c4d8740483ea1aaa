//! Replay of the stretches drawn.

use std::collections::BTreeSet;
use std::ops::Range;

use super::design::Design;
use super::{Spent, timed};
use crate::Result;
use crate::fermi::caches::{self, Span};
use crate::fermi::launch::Launch;
use crate::fermi::machine::Machine;
use crate::fermi::simt::LANES;
use crate::fermi::times::Times;
use crate::trace::StepTrace;

/// Draws from which the load on the memory system is taken: two places tell it as well as all, because the latencies
/// that follow from it change by a few cycles only.
const LOAD_DRAWS: usize = 2;

/// What the replayed stretches did.
#[derive(Clone, Debug, Default)]
pub(super) struct Sample {
    /// Each block of the launch, if it was measured.
    pub(super) measured: Vec<Option<Span>>,
    /// Latencies with the queues that the first stretches cause.
    pub(super) times: Option<Times>,
    /// Blocks replayed, those not counted among them; a pass without queues and one with them count as two.
    pub(super) replayed: usize,
    /// Blocks replayed, each once.
    pub(super) blocks: usize,
}

impl Sample {
    /// Replays what draws 0..`draws` want and earlier ones did not.
    pub(super) fn extend(
        &mut self,
        machine: &Machine,
        whole: &Launch,
        (design, draws): (&Design, usize),
        spent: &mut Spent,
    ) -> Result<()> {
        self.measured.resize(design.blocks(), None);
        timed(&mut spent.replay, || {
            let times = match self.times {
                Some(times) => times,
                None => {
                    let unloaded = Times::unloaded(machine);
                    let (_, outcome) = self.pass(machine, whole, &self.wanted(design, LOAD_DRAWS), design, unloaded)?;
                    self.replayed += outcome.spans.len();
                    unloaded.with_queues(machine, &outcome.load())
                }
            };
            self.times = Some(times);
            let new = self.wanted(design, draws);
            if new.is_empty() {
                return Ok(());
            }
            let (runs, outcome) = self.pass(machine, whole, &new, design, times)?;
            self.replayed += outcome.spans.len();
            self.blocks += outcome.spans.len();
            for (block, span) in runs.into_iter().flatten().zip(outcome.spans) {
                if new.iter().any(|blocks| blocks.contains(&block)) {
                    self.measured[block] = Some(span);
                }
            }
            Ok(())
        })
    }

    /// Stretches of draws 0..`draws` that were not measured yet, in order.
    fn wanted(&self, design: &Design, draws: usize) -> Vec<Range<usize>> {
        let drawn: BTreeSet<usize> = (0..draws).map(|draw| design.draw(draw)).collect();
        let blocks = drawn.into_iter().map(|stretch| design.stretches[stretch].blocks.clone());
        blocks.filter(|blocks| self.measured[blocks.start].is_none()).collect()
    }

    /// One launch of `stretches` and what goes with them. Returns its blocks by their numbers in the whole one.
    fn pass(
        &self,
        machine: &Machine,
        whole: &Launch,
        stretches: &[Range<usize>],
        design: &Design,
        times: Times,
    ) -> Result<(Vec<Range<usize>>, caches::Outcome)> {
        let runs = runs(design, stretches);
        let threads = whole.block_threads();
        let mut trace = StepTrace { starts: vec![0], steps: Vec::new() };
        for run in &runs {
            trace.append(whole.workload.trace, run.start * threads..(run.end * threads).min(whole.rays()));
        }
        let mut launch = *whole;
        launch.workload.trace = &trace;
        let outcome = caches::pass(machine, &launch, times)?;
        Ok((runs, outcome))
    }

    /// Warps replayed.
    pub(super) fn warps(&self, launch: &Launch) -> usize {
        self.blocks * launch.block_threads() / LANES
    }
}

/// Blocks to replay for `stretches`, which are in order: each with those that warm it, the first with those that fill
/// the machine, the last with those that keep it full.
fn runs(design: &Design, stretches: &[Range<usize>]) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for stretch in stretches {
        let before = if runs.is_empty() { design.wave } else { design.before() };
        let first = stretch.start.saturating_sub(before);
        match runs.last_mut() {
            Some(last) if first <= last.end => last.end = stretch.end,
            _ => runs.push(first..stretch.end),
        }
    }
    if let Some(last) = runs.last_mut() {
        last.end = (last.end + design.wave).min(design.blocks());
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::super::design::tests::blocks;
    use super::*;

    #[test]
    fn stretches_are_warmed_up_and_none_is_replayed_twice() {
        let design = Design::new(blocks((0..100).map(|_| 1.0)), 8, 1);
        assert_eq!(runs(&design, &[12..16, 32..36, 40..44]), [4..16, 28..52]);
        assert_eq!(runs(&design, &[48..52, 96..100]), [40..52, 92..100]);
        assert!(runs(&design, &[]).is_empty());
    }
}
