//! When a launch ends: a matter of its longest blocks, and of which multiprocessor gets them.

use rayon::prelude::*;

use super::schedule::Scheduler;
use crate::scene::procedural::random::Random;
use crate::statistics::{CONFIDENCE, Estimate, student_t};

/// Launches drawn.
const DRAWS: usize = 16;

/// Measured blocks of most similar expectations, one of which tells how another departs from its own: long blocks are
/// more like what is expected of them than short ones.
const SIMILAR: usize = 16;

/// The blocks of a launch, of which some were measured.
pub(super) struct Blocks {
    /// Cycles of each that was.
    pub(super) measured: Vec<Option<f64>>,
    /// Cycles that each is expected to take by what is known of it.
    pub(super) expected: Vec<f64>,
}

/// How long a launch takes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ending {
    /// When the last multiprocessor is done.
    pub(super) cycles: Estimate,
    /// When one is in the mean.
    pub(super) busy: f64,
    /// Half the interval, as a part of the cycles, that comes from not knowing the other blocks one by one.
    pub(super) half: f64,
}

impl Blocks {
    /// The ending if the mean of those not measured is `mean`. Expectations are more even than blocks are, and a launch of
    /// even blocks ends too early: so each gets the ratio to its expectation of one like it that was measured, drawn at
    /// random (hot-deck imputation within classes: Särndal et al. 1992, section 15.7), and the launch is drawn several
    /// times.
    pub(super) fn ending(&self, scheduler: &Scheduler, mean: &Estimate, seed: u64) -> Ending {
        let ratios = self.ratios();
        let like = |expected: f64, random: &mut Random| {
            let place = ratios.partition_point(|&(of, _)| of < expected).saturating_sub(SIMILAR / 2);
            let first = place.min(ratios.len().saturating_sub(SIMILAR));
            let similar = &ratios[first..ratios.len().min(first + SIMILAR)];
            if similar.is_empty() { 1.0 } else { random.pick(similar).1 }
        };
        let draws: Vec<(f64, f64)> = (0..DRAWS)
            .into_par_iter()
            .map(|draw| {
                let mut random = Random::stream(seed, draw as u64);
                self.run(scheduler, mean.value, |expected| like(expected, &mut random))
            })
            .collect();
        let ends: Vec<f64> = draws.iter().map(|(cycles, _)| *cycles).collect();
        let value = ends.iter().sum::<f64>() / DRAWS as f64;
        // The launch is one more draw, not their mean.
        let half = student_t(&ends, CONFIDENCE).map_or(0.0, |of_mean| of_mean.half()) * (DRAWS as f64 + 1.0).sqrt();
        // Multiprocessors take as much longer as their blocks do, of which some are known.
        let known: f64 = self.measured.iter().flatten().sum();
        let others = self.measured.iter().filter(|cycles| cycles.is_none()).count() as f64 * mean.value;
        let [low, high] = mean.interval.map(|end| value * (1.0 + (end / mean.value - 1.0) * others / (known + others)));
        let cycles = Estimate { value, interval: [low, high] }.widened(half);
        Ending { cycles, busy: draws.iter().map(|(_, busy)| busy).sum::<f64>() / DRAWS as f64, half: half / value }
    }

    /// Of each block that was measured: what was expected, the least first, and the ratio of its cycles to that.
    fn ratios(&self) -> Vec<(f64, f64)> {
        let ratio = |(cycles, &expected): (&Option<f64>, &f64)| {
            cycles.filter(|_| expected > 0.0).map(|cycles| (expected, cycles / expected))
        };
        let mut ratios: Vec<(f64, f64)> = self.measured.iter().zip(&self.expected).filter_map(ratio).collect();
        ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
        ratios
    }

    /// One launch, in which those not measured take `mean` in the mean and are as their expectations times `ratio` of it.
    fn run(&self, scheduler: &Scheduler, mean: f64, mut ratio: impl FnMut(f64) -> f64) -> (f64, f64) {
        let each = self.measured.iter().zip(&self.expected);
        let cycles: Vec<f64> =
            each.map(|(cycles, &expected)| cycles.unwrap_or_else(|| expected * ratio(expected))).collect();
        let others = || self.measured.iter().zip(&cycles).filter(|(measured, _)| measured.is_none());
        let sum: f64 = others().map(|(_, cycles)| cycles).sum();
        let scale = if sum > 0.0 { mean.max(0.0) * others().count() as f64 / sum } else { 0.0 };
        scheduler.run(self.measured.iter().zip(&cycles).map(|(measured, cycles)| match measured {
            Some(_) => *cycles,
            None => cycles * scale,
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCHEDULER: Scheduler = Scheduler { sms: 4, slots: 1, by_itself: 1.0 };

    fn certain(value: f64) -> Estimate {
        Estimate { value, interval: [value, value] }
    }

    #[test]
    fn even_blocks_end_as_the_scheduler_says() {
        let blocks = Blocks { measured: [vec![Some(2.0); 4], vec![None; 16]].concat(), expected: vec![2.0; 20] };
        let ending = blocks.ending(&SCHEDULER, &certain(3.0), 1);
        assert_eq!((ending.cycles.value, ending.busy, ending.half), (14.0, 14.0, 0.0));
        let wide = Estimate { value: 3.0, interval: [2.0, 4.0] };
        let interval = blocks.ending(&SCHEDULER, &wide, 1).cycles.interval;
        assert!((interval[0] - 10.0).abs() < 1e-9 && (interval[1] - 18.0).abs() < 1e-9, "{interval:?}");
    }

    #[test]
    fn blocks_that_differ_from_what_is_expected_end_later_by_no_certain_time() {
        let measured = (0..40).map(|i| Some(if i % 2 == 0 { 1.0 } else { 3.0 })).chain(vec![None; 40]).collect();
        let blocks = Blocks { measured, expected: vec![2.0; 80] };
        let ending = blocks.ending(&SCHEDULER, &certain(2.0), 1);
        let even = blocks.run(&SCHEDULER, 2.0, |_| 1.0).0;
        assert!(ending.cycles.value > even && ending.half > 0.0, "{ending:?}, {even}");
        assert!(ending.cycles.interval[0] < ending.cycles.value - 0.9 * ending.half * ending.cycles.value);
    }
}
