//! What the whole launch does, from what the drawn stretches did.

use super::design::{Design, Stretch};
use super::schedule::makespan;
use super::stretch::Sample;
use super::work::Block;
use crate::fermi::caches::{Outcome, Span};
use crate::fermi::result::Counts;
use crate::statistics::{CONFIDENCE, Estimate, regression};

/// Estimates with their intervals.
#[derive(Clone, Debug)]
pub(super) struct Estimates {
    pub(super) cycles: Estimate,
    pub(super) l1: Estimate,
    pub(super) l2: Estimate,
    /// The whole launch.
    pub(super) outcome: Outcome,
}

/// A measured stretch: what its blocks did together.
struct Draw<'a> {
    stretch: &'a Stretch,
    span: Span,
    /// Warp instructions a cycle of its blocks alone.
    issue: f64,
}

/// The measured stretches, and what is left to be told by them.
struct Pool<'a> {
    /// Each once, however often it was drawn.
    draws: Vec<Draw<'a>>,
    /// Warp instructions a cycle of the blocks alone that were not measured.
    issue: f64,
    /// As many stretches of equal cost would vary like those that were not measured.
    others: f64,
}

impl Estimates {
    /// `None` if fewer than three stretches were measured, which leave no freedom to a regression, or all.
    pub(super) fn new(design: &Design, sample: &Sample) -> Option<Estimates> {
        let blocks = || design.work.iter().zip(&sample.measured);
        let unmeasured = || blocks().filter(|(_, span)| span.is_none()).map(|(block, _)| block);
        let unknown: f64 = unmeasured().map(|block| block.alone).sum();
        let (measured, rest): (Vec<&Stretch>, Vec<&Stretch>) =
            design.stretches.iter().partition(|stretch| sample.measured[stretch.blocks.start].is_some());
        let pool = Pool {
            draws: measured.into_iter().map(|stretch| Draw::new(design, sample, stretch)).collect(),
            issue: issue(unmeasured()),
            // The effective number of Kish 1965, section 11.7.
            others: unknown.powi(2) / rest.iter().map(|stretch| stretch.alone.powi(2)).sum::<f64>(),
        };
        if rest.is_empty() {
            return None;
        }
        let slowdown = pool.mean(|span| span.cycles)?;
        let whole = |slowdown: f64| {
            makespan(design.wave, blocks().map(|(block, span)| span.map_or(block.alone * slowdown, |span| span.cycles)))
        };
        let (cycles, busy) = whole(slowdown.value);
        let mut total = Span::default();
        blocks().filter_map(|(_, span)| span.as_ref()).for_each(|span| total.add(span, 1.0));
        for draw in &pool.draws {
            total.add(&draw.span, unknown / draw.stretch.alone / pool.draws.len() as f64);
        }
        // What follows from the steps alone is known.
        (total.instructions, total.visits, total.compute) = Default::default();
        for block in &design.work {
            total.instructions.add(&block.instructions);
            total.visits += block.visits;
            total.compute += block.compute;
        }
        let share = unknown / design.work.iter().map(|block| block.alone).sum::<f64>();
        Some(Estimates {
            cycles: Estimate { value: cycles, interval: slowdown.interval.map(|end| whole(end.max(0.0)).0) },
            l1: pool.miss_rate(share, total.l1, |span| span.l1)?,
            l2: pool.miss_rate(share, total.l2, |span| span.l2)?,
            outcome: Outcome { cycles, busy_cycles: busy, total, spans: Vec::new() },
        })
    }
}

impl<'a> Draw<'a> {
    fn new(design: &'a Design, sample: &Sample, stretch: &'a Stretch) -> Draw<'a> {
        let mut span = Span::default();
        sample.measured[stretch.blocks.clone()].iter().flatten().for_each(|block| span.add(block, 1.0));
        Draw { stretch, span, issue: issue(design.work[stretch.blocks.clone()].iter()) }
    }
}

impl Pool<'_> {
    /// Mean of `of` over the cost alone, of blocks that were not measured. Blocks that issue more wait more for each
    /// other, and how much all of them issue is known: a regression on that (Cochran 1977, section 7.1).
    fn mean(&self, of: impl Fn(&Span) -> f64) -> Option<Estimate> {
        let pairs: Vec<[f64; 2]> = self.draws.iter().map(|d| [d.issue, of(&d.span) / d.stretch.alone]).collect();
        regression(&pairs, self.issue, self.others, CONFIDENCE)
    }

    /// A miss rate that is near `total`'s: of a ratio only its linear part is regressed (Cochran 1977, section 6.4).
    /// `share` of the launch was not measured.
    fn miss_rate(&self, share: f64, total: Counts, of: impl Fn(&Span) -> Counts) -> Option<Estimate> {
        let rate = total.miss_rate();
        let accesses = self.mean(|span| of(span).accesses as f64)?.value;
        let rest = self.mean(|span| of(span).misses as f64 - rate * of(span).accesses as f64)?;
        // Nothing accessed has no misses.
        let scaled = |end: f64| if accesses > 0.0 { (rate + share * end / accesses).clamp(0.0, 1.0) } else { rate };
        Some(Estimate { value: scaled(rest.value), interval: rest.interval.map(scaled) })
    }
}

/// Warp instructions a cycle of `blocks` alone.
fn issue<'a>(blocks: impl Iterator<Item = &'a Block>) -> f64 {
    let (mut instructions, mut cycles) = (0.0, 0.0);
    for block in blocks {
        instructions += block.instructions.warp as f64;
        cycles += block.alone;
    }
    if cycles > 0.0 { instructions / cycles } else { 0.0 }
}
