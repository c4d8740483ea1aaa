//! What the whole launch does, from what the drawn stretches did.

use super::design::Design;
use super::schedule::makespan;
use super::stretch::Sample;
use crate::fermi::caches::{Outcome, Span};
use crate::scene::procedural::random::Random;
use crate::statistics::{CONFIDENCE, Estimate, quantile};

/// Resamples for a standard error: its own error is a twelfth (Efron and Tibshirani 1993, section 6.4: 50 to 200 do).
const RESAMPLES: usize = 64;

/// Estimates with their intervals.
#[derive(Clone, Debug)]
pub(super) struct Estimates {
    pub(super) cycles: Estimate,
    pub(super) l1: Estimate,
    pub(super) l2: Estimate,
    /// The whole launch.
    pub(super) outcome: Outcome,
}

/// The drawn stretches as a population to draw from.
struct Pool<'a> {
    design: &'a Design,
    sample: &'a Sample,
    /// Blocks of each draw, and what they did together, over their size.
    draws: Vec<(&'a super::design::Stretch, Span)>,
    /// What measured blocks did together.
    known: Span,
    /// Size of all blocks not measured.
    unknown: f64,
}

/// One way the launch may be.
struct Whole {
    cycles: f64,
    busy: f64,
    total: Span,
}

impl Estimates {
    pub(super) fn new(design: &Design, sample: &Sample, draws: usize, seed: u64) -> Estimates {
        let pool = Pool::new(design, sample, draws);
        let mut random = Random::stream(seed, draws as u64);
        let all: Vec<usize> = (0..draws).collect();
        let value = pool.whole(&all, &mut random);
        let resamples: Vec<Whole> = (0..RESAMPLES)
            .map(|_| {
                let again: Vec<usize> = all.iter().map(|_| random.pick(&all)).collect();
                pool.whole(&again, &mut random)
            })
            .collect();
        // A resample varies less than the sample does by a factor of (n - 1) / n (Efron and Tibshirani 1993, section
        // 5.3), and few draws have Student's tail.
        let n = draws as f64;
        let widen = quantile(CONFIDENCE, draws as u32 - 1) * (n / (n - 1.0)).sqrt();
        let estimate = |of: &dyn Fn(&Whole) -> f64, value: f64| {
            let values: Vec<f64> = resamples.iter().map(of).collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64;
            let half = widen * variance.sqrt();
            Estimate { value, interval: [(value - half).max(0.0), value + half] }
        };
        // The end of a launch is that of its longest block, which a single draw may miss: the mean of many.
        let cycles = resamples.iter().map(|whole| whole.cycles).sum::<f64>() / RESAMPLES as f64;
        let busy = resamples.iter().map(|whole| whole.busy).sum::<f64>() / RESAMPLES as f64;
        let (l1, l2) = (|whole: &Whole| whole.total.l1.miss_rate(), |whole: &Whole| whole.total.l2.miss_rate());
        Estimates {
            cycles: estimate(&|whole| whole.cycles, cycles),
            l1: estimate(&l1, l1(&value)),
            l2: estimate(&l2, l2(&value)),
            outcome: Outcome { cycles, busy_cycles: busy, total: value.total, spans: Vec::new() },
        }
    }

    /// Half the interval over the value: the larger of cycles and the L1's miss rate.
    pub(super) fn relative_error(&self) -> f64 {
        self.cycles.relative_error().max(self.l1.relative_error())
    }
}

impl<'a> Pool<'a> {
    fn new(design: &'a Design, sample: &'a Sample, draws: usize) -> Pool<'a> {
        let mut known = Span::default();
        sample.measured.iter().flatten().for_each(|span| known.add(span, 1.0));
        let unmeasured = design.sizes.iter().zip(&sample.measured).filter(|(_, span)| span.is_none());
        let unknown = unmeasured.map(|(size, _)| size).sum();
        let draws = (0..draws)
            .map(|draw| {
                let stretch = &design.stretches[design.draw(draw)];
                let mut mean = Span::default();
                sample.measured[stretch.blocks.clone()].iter().flatten().for_each(|span| mean.add(span, 1.0));
                (stretch, mean)
            })
            .collect();
        Pool { design, sample, draws, known, unknown }
    }

    /// The launch if blocks that were not measured go by the ratios to size of those of `draws`.
    fn whole(&self, draws: &[usize], random: &mut Random) -> Whole {
        let mut total = self.known;
        for &draw in draws {
            let (stretch, span) = &self.draws[draw];
            total.add(span, self.unknown / stretch.size / draws.len() as f64);
        }
        let Pool { design, sample, .. } = self;
        let blocks = design.sizes.iter().zip(&sample.measured);
        let cycles = blocks.map(|(size, measured)| match measured {
            Some(span) => span.cycles,
            None => size * self.ratio(draws, random),
        });
        let (end, mean) = makespan(design.wave, cycles);
        Whole { cycles: end, busy: mean, total }
    }

    /// Cycles over size of a block of one of `draws`, drawn in proportion to size.
    fn ratio(&self, draws: &[usize], random: &mut Random) -> f64 {
        let (stretch, _) = &self.draws[random.pick(draws)];
        let mut at = stretch.size * f64::from(random.unit());
        for block in stretch.blocks.clone() {
            at -= self.design.sizes[block];
            if at <= 0.0 {
                return self.sample.measured[block].map_or(0.0, |span| span.cycles) / self.design.sizes[block];
            }
        }
        0.0
    }
}
