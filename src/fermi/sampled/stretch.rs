//! Replay of the stretches drawn.

use std::collections::BTreeSet;
use std::ops::Range;

use super::design::Design;
use super::{Source, Spent, launch, timed, workload};
use crate::Result;
use crate::fermi::caches::{self, Span};
use crate::fermi::kernel::Kernel;
use crate::fermi::machine::Machine;
use crate::fermi::simt::LANES;
use crate::fermi::times::Times;
use crate::trace::StepTrace;

/// What the replayed stretches did.
#[derive(Clone, Debug, Default)]
pub(super) struct Sample {
    /// Each block of the launch, if it was measured.
    pub(super) measured: Vec<Option<Span>>,
    /// Latencies with the queues that the first stretches cause.
    pub(super) times: Option<Times>,
    /// Blocks replayed, those not counted among them; a pass without queues and one with them count as two.
    pub(super) replayed: usize,
    /// Blocks recorded.
    pub(super) recorded: usize,
}

impl Sample {
    /// Replays what draws 0..`draws` want and earlier ones did not, as one launch: the blocks before a stretch go
    /// before it uncounted, and blocks after the last keep multiprocessors full until it ends.
    pub(super) fn extend(
        &mut self,
        machine: &Machine,
        kernel: &Kernel,
        source: &impl Source,
        (design, draws): (&Design, usize),
        spent: &mut Spent,
    ) -> Result<()> {
        self.measured.resize(design.blocks(), None);
        let wanted: BTreeSet<usize> = (0..draws).map(|draw| design.draw(draw)).collect();
        let new: Vec<Range<usize>> = wanted
            .into_iter()
            .map(|stretch| design.stretches[stretch].blocks.clone())
            .filter(|blocks| self.measured[blocks.start].is_none())
            .collect();
        let runs = runs(design, &new);
        let Some(threads) = (!runs.is_empty()).then_some(kernel.threads as usize) else { return Ok(()) };
        let trace = timed(&mut spent.recording, || {
            let mut trace = StepTrace { starts: vec![0], steps: Vec::new() };
            for run in &runs {
                trace.append(&source.record(run.start * threads..(run.end * threads).min(source.rays())));
            }
            trace
        });
        let launch = launch(kernel, workload(source, &trace));
        let outcome = timed(&mut spent.model, || {
            let times = match self.times {
                Some(times) => times,
                None => {
                    self.replayed += launch.blocks();
                    let unloaded = Times::unloaded(machine);
                    unloaded.with_queues(machine, &caches::pass(machine, &launch, unloaded)?.load())
                }
            };
            self.times = Some(times);
            caches::pass(machine, &launch, times)
        })?;
        self.replayed += launch.blocks();
        self.recorded += launch.blocks();
        for (block, span) in runs.into_iter().flatten().zip(outcome.spans) {
            if new.iter().any(|blocks| blocks.contains(&block)) {
                self.measured[block] = Some(span);
            }
        }
        Ok(())
    }

    /// Warps recorded.
    pub(super) fn warps(&self, kernel: &Kernel) -> usize {
        self.recorded * kernel.threads as usize / LANES
    }
}

/// Blocks to replay for `stretches`, which are in order: each with those that warm it, the last with those that follow.
fn runs(design: &Design, stretches: &[Range<usize>]) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for stretch in stretches {
        let first = stretch.start.saturating_sub(design.wave);
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
    use super::*;

    #[test]
    fn stretches_are_warmed_up_and_none_is_replayed_twice() {
        let design = Design::of(vec![1.0; 100], 4, 1);
        assert_eq!(runs(&design, &[0..5, 20..25, 25..30, 33..38]), [0..5, 16..42]);
        assert_eq!(runs(&design, &[50..55, 95..100]), [46..55, 91..100]);
        assert!(runs(&design, &[]).is_empty());
    }
}
