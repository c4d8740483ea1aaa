//! Samples of clusters whose sizes are known beforehand: the largest are measured all, of the others each draw takes one
//! in proportion to its size.
//!
//! A heavy tail breaks any interval from a plain sample: what the mean consists of is rarely drawn. If a size is known
//! that goes with the value (the steps of a warp, say), the tail can be told beforehand and leaves nothing to chance
//! (Särndal et al. 1992, section 3.6), and the rest is drawn in proportion to size (Hansen and Hurwitz 1943) and estimated
//! by the ratio of values to sizes (Cochran 1977, section 6.1), from which values depart without a tail.

use super::{Estimate, moments, student_t};
use crate::scene::procedural::random::Random;

/// Part of the sample that the tail may take.
const TAIL_SHARE: f64 = 0.5;

/// Part of the draws that do not go by size: bounds the weight of clusters whose size says too little (defensive
/// mixture, Hesterberg 1995).
const UNIFORM: f64 = 0.1;

/// Fewest draws: a variance needs two, and with few degrees of freedom Student's t is wide.
const LEAST: usize = 5;

/// Which clusters to draw.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// Clusters that are measured for certain.
    pub tail: Vec<usize>,
    /// All others.
    pub rest: Vec<usize>,
    /// Draws from the rest, with repetition; none if there is no rest.
    pub draws: usize,
    /// Sizes of the rest.
    sizes: Vec<f64>,
    /// Running sums of the chances of the rest; the last is 1.
    sums: Vec<f64>,
}

impl Design {
    /// A design that measures at most `budget` of the clusters of these `sizes`, which are not negative, but at least
    /// five. The tail are those which as many draws would take for certain.
    pub fn new(sizes: &[f64], budget: usize) -> Design {
        let mut order: Vec<usize> = (0..sizes.len()).collect();
        order.sort_by(|&a, &b| sizes[b].total_cmp(&sizes[a]).then(a.cmp(&b)));
        let tail = if budget >= sizes.len() { sizes.len() } else { tail(&order, sizes, budget) };
        let rest = order.split_off(tail);
        let total: f64 = rest.iter().map(|&i| sizes[i]).sum();
        let even = 1.0 / rest.len() as f64;
        let chance = |i: usize| if total > 0.0 { (1.0 - UNIFORM) * sizes[i] / total + UNIFORM * even } else { even };
        let mut sum = 0.0;
        let sums = rest.iter().map(|&i| {
            sum += chance(i);
            sum
        });
        let sums = sums.collect();
        let draws = if rest.is_empty() { 0 } else { budget.saturating_sub(tail).max(LEAST) };
        Design { tail: order, sizes: rest.iter().map(|&i| sizes[i]).collect(), rest, draws, sums }
    }

    /// Clusters drawn from the rest, as indices into it.
    pub fn draw(&self, seed: u64) -> Vec<usize> {
        let mut random = Random::new(seed);
        let last = self.rest.len().saturating_sub(1);
        let mut one = || {
            // 53 bits, all that a double holds.
            let at = (random.bits() >> 11) as f64 / (1u64 << 53) as f64;
            self.sums.partition_point(|&sum| sum <= at).min(last)
        };
        (0..self.draws).map(|_| one()).collect()
    }

    /// The mean over all clusters from the values of the tail and of those `drawn` from the rest, with Student's interval.
    /// `value` takes a cluster's index. `None` without clusters.
    pub fn mean(&self, drawn: &[usize], value: impl Fn(usize) -> f64, confidence: f64) -> Option<Estimate> {
        let population = (self.tail.len() + self.rest.len()) as f64;
        let certain = self.tail.iter().map(|&i| value(i)).sum::<f64>() / population;
        if self.rest.is_empty() {
            return (population > 0.0).then_some(Estimate { value: certain, interval: [certain, certain] });
        }
        let before = |k: usize| if k == 0 { 0.0 } else { self.sums[k - 1] };
        let totals = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
            drawn.iter().map(|&k| of(k) / (self.sums[k] - before(k)) / population).collect()
        };
        let (values, _) = moments(&totals(&|k| value(self.rest[k])));
        let (sizes, _) = moments(&totals(&|k| self.sizes[k]));
        let size = self.sizes.iter().sum::<f64>() / population;
        // Without sizes there is no ratio, and values alone tell.
        let (ratio, scale) = if sizes > 0.0 { (values / sizes, size / sizes) } else { (0.0, 1.0) };
        let residuals = totals(&|k| scale * (value(self.rest[k]) - ratio * self.sizes[k]));
        let Estimate { value: rest, interval } = student_t(&residuals, confidence)?;
        let regressed = certain + ratio * size;
        Some(Estimate { value: regressed + rest, interval: interval.map(|end| regressed + end) })
    }
}

/// How many of the largest clusters as many draws in proportion to size would take for certain.
fn tail(order: &[usize], sizes: &[f64], budget: usize) -> usize {
    let mut rest: f64 = order.iter().map(|&i| sizes[i]).sum();
    let most = (TAIL_SHARE * budget as f64) as usize;
    let mut tail = 0;
    for &i in order.iter().take(most) {
        if sizes[i] * ((budget - tail) as f64) < rest || rest <= 0.0 {
            break;
        }
        rest -= sizes[i];
        tail += 1;
    }
    tail
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sizes() -> Vec<f64> {
        let mut sizes: Vec<f64> = (0..500).map(|i| f64::from(i % 10)).collect();
        sizes[77] = 5000.0;
        sizes[300] = 9000.0;
        sizes
    }

    #[test]
    fn each_cluster_is_in_the_tail_or_drawn_by_its_size() {
        let sizes = sizes();
        let design = Design::new(&sizes, 60);
        assert_eq!((design.tail.as_slice(), design.draws), (&[300, 77][..], 58));
        let mut all = [&design.tail[..], &design.rest].concat();
        all.sort_unstable();
        assert_eq!(all, Vec::from_iter(0..500));
        let many = Design { draws: 200_000, ..design };
        let drawn = many.draw(1);
        let of_size = |size: f64| drawn.iter().filter(|&&k| sizes[many.rest[k]] == size).count() as f64;
        // Chances of 0.9 x 9 / 2233 + 0.1 / 498 and 0.1 / 498.
        let (large, none) = (of_size(9.0) / 50.0, of_size(0.0) / 50.0);
        assert!((large / none / (1.0 + 0.9 * 9.0 / 2233.0 / (0.1 / 498.0)) - 1.0).abs() < 0.1, "{large} {none}");
    }

    #[test]
    fn values_near_proportion_to_size_leave_little_to_chance() {
        let sizes = sizes();
        let value = |i: usize| sizes[i] * (1.0 + 0.3 * (i as f64).sin());
        let truth = (0..500).map(value).sum::<f64>() / 500.0;
        let design = Design::new(&sizes, 40);
        let estimates: Vec<Estimate> =
            (0..1000).map(|seed| design.mean(&design.draw(seed), value, 0.95).unwrap()).collect();
        assert!(estimates.iter().all(|estimate| estimate.relative_error() < 0.03));
        let holds = estimates.iter().filter(|estimate| estimate.holds(truth)).count();
        assert!((920..=980).contains(&holds), "{holds} of 1000 intervals hold {truth}");
    }

    #[test]
    fn a_census_is_certain_and_edge_cases_are_defined() {
        let sizes = [3.0, 1.0, 2.0];
        let design = Design::new(&sizes, 3);
        assert_eq!(
            design.mean(&design.draw(1), |i| sizes[i], 0.95),
            Some(Estimate { value: 2.0, interval: [2.0, 2.0] })
        );
        assert_eq!(Design::new(&[], 10).mean(&[], |_| 0.0, 0.95), None);
        let nothing = Design::new(&[0.0; 20], 4);
        assert_eq!((nothing.tail.len(), nothing.draws), (0, LEAST));
        assert_eq!(nothing.mean(&nothing.draw(1), |_| 7.0, 0.95).unwrap().interval.map(f64::round), [7.0, 7.0]);
    }
}
