//! What the whole launch does, from what some of its multiprocessors and glimpses of all did.

use super::design::Design;
use super::ending::{Blocks, Ending};
use super::sample::Sample;
use super::schedule::Scheduler;
use super::work::{Block, KNOWN};
use crate::fermi::caches::{Outcome, Span};
use crate::fermi::result::Counts;
use crate::statistics::{self, CONFIDENCE, Estimate, Plane, centre, regression, student_t};

/// Estimates with their intervals.
#[derive(Clone, Debug)]
pub(super) struct Estimates {
    pub(super) cycles: Estimate,
    pub(super) l1: Estimate,
    pub(super) l2: Estimate,
    pub(super) parts: Parts,
    /// The whole launch.
    pub(super) outcome: Outcome,
}

/// What the relative error of cycles comes from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parts {
    /// Which blocks were measured.
    pub(super) blocks: f64,
    /// What the L2 held.
    pub(super) l2: f64,
    /// The launch's end, which more measurements do not tell.
    pub(super) end: f64,
}

/// The blocks measured, and what is left to be told by them.
struct Pool {
    /// What is known of each block that was measured, and what it did, in the order of the launch.
    measured: Vec<([f64; KNOWN], Span)>,
    /// Blocks of a cluster.
    cluster: usize,
    /// Mean of what is known of those that were not, and their number.
    known: [f64; KNOWN],
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
        let second = SecondLevel::of(sample)?;
        let mut spans = vec![None; design.blocks()];
        for (number, run) in sample.runs.iter().enumerate() {
            let given = |k: usize| sample.given.get(k).filter(|_| number == 0);
            for (k, (&block, even)) in run.blocks.iter().zip(&run.spans).enumerate() {
                spans[block] = Some(second.corrected(even, given(k)));
            }
        }
        let unmeasured: Vec<&Block> =
            design.work.iter().zip(&spans).filter(|(_, span)| span.is_none()).map(|(block, _)| block).collect();
        let unknown: f64 = unmeasured.iter().map(|block| block.alone).sum();
        let others = unmeasured.len() as f64;
        if unknown == 0.0 {
            return None;
        }
        let known = || design.work.iter().zip(&spans).filter_map(|(block, span)| Some((block.known(), (*span)?)));
        let rest: Vec<_> = unmeasured.iter().map(|block| (block.known(), 0.0)).collect();
        let pool = Pool { measured: known().collect(), cluster, known: centre(&rest).0, others };

        let by_blocks = pool.mean(|span| span.cycles)?;
        let by_l2 = second.half(pool.per_block(|span| span.reused.misses as f64));
        let mean = by_blocks.widened(by_l2);
        let plane = Plane::through(&pool.sample(|span| span.cycles));
        let scheduler = Scheduler { sms: design.sms, slots: design.slots, by_itself: sample.by_itself };
        let blocks = Blocks {
            measured: spans.iter().map(|span| span.map(|span| span.cycles)).collect(),
            expected: design.work.iter().map(|block| plane.at(block.known()).max(0.0)).collect(),
        };
        let Ending { cycles, busy, half } = blocks.ending(&scheduler, &mean, design.seed);

        let mut total = Span::default();
        let measured: f64 = known().map(|(known, _)| known[0]).sum();
        known().for_each(|(_, span)| total.add(&span, 1.0 + unknown / measured));
        // What follows from the steps alone is known.
        (total.instructions, total.visits, total.compute) = Default::default();
        for block in &design.work {
            total.instructions.add(&block.instructions);
            total.visits += block.visits;
            total.compute += block.compute;
        }
        let l1 = pool.rate(|span| [span.l1.misses as f64, span.l1.accesses as f64])?;
        let l2 = second.of_all(&pool)?;
        total.l1.misses = (l1.value * total.l1.accesses as f64) as u64;
        total.l2.misses = (l2.value * total.l2.accesses as f64) as u64;
        Some(Estimates {
            cycles,
            l1,
            l2,
            parts: Parts { blocks: by_blocks.relative_error(), l2: by_l2 / mean.value, end: half },
            outcome: Outcome { cycles: cycles.value, busy_cycles: busy, total, spans: Vec::new() },
        })
    }
}

/// The L2, between an even share of it, to which no other multiprocessor brings any of the tree, and one that has all of
/// the tree.
struct SecondLevel {
    /// Miss rate of the whole machine for lines of the tree and of stacks.
    rate: Estimate,
    /// Where it lies: 0 is with all of the tree, 1 with an even share.
    missed: Estimate,
    /// Cycles of a block that all of the tree spares, for each such miss with an even share.
    miss: f64,
    /// Misses of the L1 with all of the tree over those with an even share.
    l1: f64,
}

impl SecondLevel {
    /// `None` without glimpses enough for an interval.
    fn of(sample: &Sample) -> Option<SecondLevel> {
        let first = sample.runs.first()?;
        let (even, given) = (Span::total(&first.spans), Span::total(&sample.given));
        let (high, low) = (even.reused.miss_rate(), given.reused.miss_rate());
        let rates: Vec<f64> = sample.glimpses.iter().map(Counts::miss_rate).collect();
        // In proportion to accesses, so that each glimpse counts the same (Hansen and Hurwitz 1943).
        let rate = student_t(&rates, CONFIDENCE)?.within(0.0, 1.0);
        let place = |rate: f64| if high > low { (rate - low) / (high - low) } else { 1.0 };
        let missed = Estimate { value: place(rate.value), interval: rate.interval.map(place) };
        Some(SecondLevel {
            rate,
            missed: missed.within(0.0, 1.0),
            l1: given.l1.misses as f64 / even.l1.misses.max(1) as f64,
            miss: (even.cycles - given.cycles) / even.reused.misses.max(1) as f64,
        })
    }

    /// Miss rate of the whole machine for all lines; those that are streamed miss as they did by themselves.
    fn of_all(&self, pool: &Pool) -> Option<Estimate> {
        let rate = self.rate.value;
        let misses = |span: &Span| (span.l2.misses - span.reused.misses) as f64 + rate * span.reused.accesses as f64;
        let share = pool.rate(|span| [span.reused.accesses as f64, span.l2.accesses as f64])?.value;
        let all = pool.rate(|span| [misses(span), span.l2.accesses as f64])?;
        Some(all.widened(self.rate.half() * share).within(0.0, 1.0))
    }

    /// What a block does in the whole machine, if it did `even` with an even share, and `given` with all of the tree.
    /// Without that, what it spares by others is known from those where it was tried.
    fn corrected(&self, even: &Span, given: Option<&Span>) -> Span {
        let spared = given.map_or(self.miss * even.reused.misses as f64, |given| even.cycles - given.cycles);
        let cycles = (even.cycles - (1.0 - self.missed.value) * spared).max(0.0);
        let scale = if even.cycles > 0.0 { cycles / even.cycles } else { 1.0 };
        let memory = ((even.compute + even.memory) * scale - even.compute).max(0.0);
        let mut l1 = even.l1;
        l1.misses = (l1.misses as f64 * (1.0 - (1.0 - self.missed.value) * (1.0 - self.l1))).round() as u64;
        Span { cycles, memory, l1, ..*even }
    }

    /// Half the interval of the cycles of a block with so many `misses` of an even share.
    fn half(&self, misses: f64) -> f64 {
        self.missed.half() * self.miss.abs() * misses
    }
}

impl Pool {
    /// Mean of `of` over the measured blocks.
    fn per_block(&self, of: impl Fn(&Span) -> f64) -> f64 {
        self.measured.iter().map(|(_, span)| of(span)).sum::<f64>() / self.measured.len() as f64
    }

    /// Mean of `of` over the blocks that were not measured: what each costs alone and how many steps it takes is known,
    /// and so a regression on it (Cochran 1977, section 7.1).
    fn mean(&self, of: impl Fn(&Span) -> f64) -> Option<Estimate> {
        let blocks = self.sample(of);
        let clusters: Vec<_> = blocks.chunks(self.cluster).map(centre).collect();
        regression(&clusters, self.known, self.others / self.cluster as f64, CONFIDENCE)
    }

    fn sample(&self, of: impl Fn(&Span) -> f64) -> Vec<statistics::Sample<KNOWN>> {
        self.measured.iter().map(|(known, span)| (*known, of(span))).collect()
    }

    /// The ratio of two sums over all blocks: only its linear part is regressed (Cochran 1977, section 6.4).
    fn rate(&self, of: impl Fn(&Span) -> [f64; 2]) -> Option<Estimate> {
        let total = |k: usize| {
            let measured: f64 = self.measured.iter().map(|(_, span)| of(span)[k]).sum();
            Some(measured + self.others * self.mean(|span| of(span)[k])?.value)
        };
        let below = total(1)?.max(1.0);
        let rate = total(0)? / below;
        let left = self.mean(|span| of(span)[0] - rate * of(span)[1])?;
        let half = left.half() * self.others / below;
        Some(Estimate { value: rate, interval: [rate - half, rate + half] }.within(0.0, 1.0))
    }
}
