//! What the whole launch does, from what some of its multiprocessors and glimpses of all did.

use super::design::Design;
use super::sample::Sample;
use super::schedule::Scheduler;
use super::work::Block;
use crate::fermi::caches::{Outcome, Span};
use crate::fermi::result::Counts;
use crate::statistics::{CONFIDENCE, Estimate, Line, regression, student_t};

/// Estimates with their intervals.
#[derive(Clone, Debug)]
pub(super) struct Estimates {
    pub(super) cycles: Estimate,
    pub(super) l1: Estimate,
    pub(super) l2: Estimate,
    /// The whole launch.
    pub(super) outcome: Outcome,
}

/// The blocks measured, and what is left to be told by them.
struct Pool {
    /// Cost alone of each block that was measured, and what it did, in the order of the launch.
    measured: Vec<(f64, Span)>,
    /// Blocks of a cluster.
    cluster: usize,
    /// Mean cost alone of those that were not, and their number.
    alone: f64,
    others: f64,
}

impl Estimates {
    /// `None` if too few blocks were measured for an interval, or all. Blocks that are at work together share caches and
    /// issue, so what is independent are clusters of as many as a multiprocessor holds.
    pub(super) fn new(design: &Design, sample: &Sample) -> Option<Estimates> {
        Estimates::with_clusters(design, sample, design.slots)
    }

    /// The same with clusters of `cluster` blocks.
    pub(super) fn with_clusters(design: &Design, sample: &Sample, cluster: usize) -> Option<Estimates> {
        let mixture = Mixture::of(sample)?;
        let spans = mixture.spans(design, sample);
        let unmeasured: Vec<&Block> =
            design.work.iter().zip(&spans).filter(|(_, span)| span.is_none()).map(|(block, _)| block).collect();
        let unknown: f64 = unmeasured.iter().map(|block| block.alone).sum();
        let others = unmeasured.len() as f64;
        if unknown == 0.0 {
            return None;
        }
        let known = || design.work.iter().zip(&spans).filter_map(|(block, span)| Some((block.alone, (*span)?)));
        let pool = Pool { measured: known().collect(), cluster, alone: unknown / others, others };

        // By how much the weight matters is known, which of the two the truth is nearer to has an interval.
        let per_weight = mixture.cycles(sample) / pool.measured.len() as f64;
        let mean = pool.mean(|span| span.cycles)?.widened(per_weight * mixture.half);
        let line = Line::through(&pool.pairs(|span| span.cycles));
        let scheduler = Scheduler { sms: design.sms, slots: design.slots, by_itself: sample.by_itself };
        let whole = |mean_of_others: f64| {
            let scale = (mean_of_others / mean.value).max(0.0);
            let blocks = design.work.iter().zip(&spans);
            scheduler.run(blocks.map(|(block, span)| match span {
                Some(span) => span.cycles,
                None => line.at(block.alone).max(0.0) * scale,
            }))
        };
        let (cycles, busy) = whole(mean.value);

        let mut total = Span::default();
        known().for_each(|(_, span)| total.add(&span, 1.0 + unknown / pool.cost()));
        // What follows from the steps alone is known.
        (total.instructions, total.visits, total.compute) = Default::default();
        for block in &design.work {
            total.instructions.add(&block.instructions);
            total.visits += block.visits;
            total.compute += block.compute;
        }
        let l1 = pool.miss_rate(|span| span.l1)?;
        let l2 = rate(sample.glimpses.iter().map(|[all, _]| all))?;
        total.l1.misses = (l1.value * total.l1.accesses as f64) as u64;
        total.l2.misses = (l2.value * total.l2.accesses as f64) as u64;
        Some(Estimates {
            cycles: Estimate { value: cycles, interval: mean.interval.map(|end| whole(end).0) },
            l1,
            l2,
            outcome: Outcome { cycles, busy_cycles: busy, total, spans: Vec::new() },
        })
    }
}

/// Where the truth lies between a multiprocessor that finds all of the tree in the L2 and one to which no other brings any
/// of it.
struct Mixture {
    /// Weight of the latter: the part of its misses for lines of the tree that the whole machine has.
    even: f64,
    /// Half the interval of the weight.
    half: f64,
}

impl Mixture {
    /// `None` without glimpses enough for an interval.
    fn of(sample: &Sample) -> Option<Mixture> {
        let mut even = Counts::default();
        sample.runs.iter().flat_map(|run| &run.even).for_each(|span| even.add(span.tree));
        let scale = 1.0 / even.miss_rate().max(f64::MIN_POSITIVE);
        let weight = rate(sample.glimpses.iter().map(|[_, tree]| tree))?.scaled(scale).within(0.0, 1.0);
        Some(Mixture { even: weight.value, half: 0.5 * (weight.interval[1] - weight.interval[0]) })
    }

    /// What each block of the launch did that was replayed.
    fn spans(&self, design: &Design, sample: &Sample) -> Vec<Option<Span>> {
        let mut spans = vec![None; design.blocks()];
        for run in &sample.runs {
            for ((&block, even), given) in run.blocks.iter().zip(&run.even).zip(&run.given) {
                let mut span = Span::default();
                span.add(even, self.even);
                span.add(given, 1.0 - self.even);
                spans[block] = Some(span);
            }
        }
        spans
    }

    /// Cycles that all blocks replayed take more with weight 1 than with weight 0.
    fn cycles(&self, sample: &Sample) -> f64 {
        let cycles = |spans: &[Span]| spans.iter().map(|span| span.cycles).sum::<f64>();
        sample.runs.iter().map(|run| cycles(&run.even) - cycles(&run.given)).sum()
    }
}

/// Miss rate of the L2 where it was looked at: in proportion to accesses, so that each glimpse counts the same (Hansen
/// and Hurwitz 1943).
fn rate<'a>(glimpses: impl Iterator<Item = &'a Counts>) -> Option<Estimate> {
    let rates: Vec<f64> = glimpses.map(Counts::miss_rate).collect();
    Some(student_t(&rates, CONFIDENCE)?.within(0.0, 1.0))
}

impl Pool {
    /// Cost alone of the measured blocks.
    fn cost(&self) -> f64 {
        self.measured.iter().map(|(alone, _)| alone).sum()
    }

    /// Mean of `of` over the blocks that were not measured: what each costs alone is known, and so a regression on it
    /// (Cochran 1977, section 7.1).
    fn mean(&self, of: impl Fn(&Span) -> f64) -> Option<Estimate> {
        let pairs = self.pairs(of);
        let mean = |cluster: &[[f64; 2]]| {
            [0, 1].map(|k| cluster.iter().map(|pair| pair[k]).sum::<f64>() / cluster.len() as f64)
        };
        let clusters: Vec<[f64; 2]> = pairs.chunks(self.cluster).map(mean).collect();
        regression(&clusters, self.alone, self.others / self.cluster as f64, CONFIDENCE)
    }

    fn pairs(&self, of: impl Fn(&Span) -> f64) -> Vec<[f64; 2]> {
        self.measured.iter().map(|(alone, span)| [*alone, of(span)]).collect()
    }

    /// The miss rate of all blocks: of a ratio only its linear part is regressed (Cochran 1977, section 6.4).
    fn miss_rate(&self, of: impl Fn(&Span) -> Counts) -> Option<Estimate> {
        let total = |count: fn(Counts) -> u64| {
            let measured: u64 = self.measured.iter().map(|(_, span)| count(of(span))).sum();
            Some(measured as f64 + self.others * self.mean(|span| count(of(span)) as f64)?.value)
        };
        let accesses = total(|counts| counts.accesses)?.max(1.0);
        let rate = total(|counts| counts.misses)? / accesses;
        let left = self.mean(|span| of(span).misses as f64 - rate * of(span).accesses as f64)?;
        let half = 0.5 * (left.interval[1] - left.interval[0]) * self.others / accesses;
        Some(Estimate { value: rate, interval: [rate - half, rate + half] }.within(0.0, 1.0))
    }
}
