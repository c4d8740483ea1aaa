//! Means by regression on something known of all.

use super::{Estimate, quantile};

/// The mean of `others` further values by the line through pairs of a known quantity and a value, if `at` is the mean of
/// their known quantity, with Student's interval (Draper and Smith 1998, section 3.1). With what a sample holds of a
/// population and this for its rest, the interval closes as the sample grows (Royall 1970). Where the known quantity
/// does not vary the line is level. `None` for fewer than three pairs, which leave no freedom.
pub fn regression(pairs: &[[f64; 2]], at: f64, others: f64, confidence: f64) -> Option<Estimate> {
    let freedom = (pairs.len() as u32).checked_sub(2).filter(|freedom| *freedom > 0)?;
    let line = Line::through(pairs);
    let lever = if line.squares > 0.0 { (at - line.mean[0]).powi(2) / line.squares } else { 0.0 };
    let residuals: f64 = pairs.iter().map(|pair| (pair[1] - line.at(pair[0])).powi(2)).sum();
    let variance = residuals / f64::from(freedom) * (1.0 / pairs.len() as f64 + 1.0 / others + lever);
    let (value, half) = (line.at(at), quantile(confidence, freedom) * variance.sqrt());
    Some(Estimate { value, interval: [value - half, value + half] })
}

/// A line by least squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// A point of it: the means.
    mean: [f64; 2],
    slope: f64,
    /// Sum of the squared distances of the known quantity from its mean.
    squares: f64,
}

impl Line {
    /// Through pairs of a known quantity and a value; level where the known quantity does not vary.
    pub fn through(pairs: &[[f64; 2]]) -> Line {
        let mean = [0, 1].map(|of| pairs.iter().map(|pair| pair[of]).sum::<f64>() / pairs.len() as f64);
        let squares: f64 = pairs.iter().map(|pair| (pair[0] - mean[0]).powi(2)).sum();
        let products: f64 = pairs.iter().map(|pair| (pair[0] - mean[0]) * (pair[1] - mean[1])).sum();
        Line { mean, slope: if squares > 0.0 { products / squares } else { 0.0 }, squares }
    }

    /// The value at a known quantity.
    pub fn at(&self, known: f64) -> f64 {
        self.mean[1] + self.slope * (known - self.mean[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::procedural::random::Random;

    #[test]
    fn the_line_is_as_by_hand() {
        let many = f64::INFINITY;
        assert_eq!(regression(&[[1.0, 1.0], [2.0, 2.0]], 1.0, many, 0.95), None);
        // Line 1 + x, residuals 1, -2, 1; t of one degree is 12.706; at 2: sqrt(6 (1/3 + 1/2)) = sqrt 5, and for the
        // mean of two sqrt(6 (1/3 + 1/2 + 1/2)) = sqrt 8.
        let pairs = [[0.0, 2.0], [1.0, 0.0], [2.0, 4.0]];
        for (others, squared) in [(many, 5f64), (2.0, 8.0)] {
            let Estimate { value, interval } = regression(&pairs, 2.0, others, 0.95).unwrap();
            assert!((value - 3.0).abs() < 1e-12 && (interval[1] - 3.0 - 12.706 * squared.sqrt()).abs() < 1e-2);
        }
        let level = regression(&[[1.0, 4.0], [1.0, 6.0], [1.0, 5.0]], 9.0, many, 0.95).unwrap();
        assert!((level.value - 5.0).abs() < 1e-12);
    }

    #[test]
    fn intervals_hold_the_rest_of_a_population_as_often_as_they_say() {
        let holds = |seed: u64| {
            let mut random = Random::new(seed);
            let all: Vec<[f64; 2]> = (0..20)
                .map(|_| {
                    let x = f64::from(random.unit());
                    [x, 3.0 + 2.0 * x + f64::from((0..4).map(|_| random.unit() - 0.5).sum::<f32>())]
                })
                .collect();
            let (sample, rest) = all.split_at(8);
            let mean = |of: usize| rest.iter().map(|pair| pair[of]).sum::<f64>() / 12.0;
            regression(sample, mean(0), 12.0, 0.95).unwrap().holds(mean(1))
        };
        let held = (0..1000).filter(|&seed| holds(seed)).count();
        assert!((930..=970).contains(&held), "{held} of 1000");
    }
}
