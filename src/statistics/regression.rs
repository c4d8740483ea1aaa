//! Means by regression on what is known of all.

use super::{Estimate, quantile};

/// A sample: what is known of it, `K` numbers, and its value.
pub type Sample<const K: usize> = ([f64; K], f64);

/// The mean of `others` further values by the least-squares plane through a sample, if `at` is the mean of what is known of
/// them, with Student's interval (Draper and Smith 1998, section 5.2). With what a sample holds of a population and this
/// for its rest, the interval closes as the sample grows (Royall 1970). `None` for a sample that leaves no freedom.
pub fn regression<const K: usize>(
    sample: &[Sample<K>],
    at: [f64; K],
    others: f64,
    confidence: f64,
) -> Option<Estimate> {
    let plane = Plane::through(sample);
    let freedom = (sample.len() as u32).checked_sub(1 + plane.used).filter(|freedom| *freedom > 0)?;
    let residuals: f64 = sample.iter().map(|(known, value)| (value - plane.at(*known)).powi(2)).sum();
    let variance = residuals / f64::from(freedom) * (1.0 / sample.len() as f64 + 1.0 / others + plane.lever(at));
    let (value, half) = (plane.at(at), quantile(confidence, freedom) * variance.sqrt());
    Some(Estimate { value, interval: [value - half, value + half] })
}

/// Means of what is known of a sample, and of its values.
pub fn centre<const K: usize>(sample: &[Sample<K>]) -> Sample<K> {
    let mean = |of: &dyn Fn(&Sample<K>) -> f64| sample.iter().map(of).sum::<f64>() / sample.len() as f64;
    (std::array::from_fn(|k| mean(&|(known, _)| known[k])), mean(&|(_, value)| *value))
}

/// A plane by least squares over `K` known numbers. It is level in those that do not vary, or vary as others do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane<const K: usize> {
    /// A point of it: the means.
    mean: Sample<K>,
    slopes: [f64; K],
    /// Inverse of the sums of squares and products of the known numbers' distances from their means.
    inverse: [[f64; K]; K],
    /// Numbers in which it is not level by definition.
    used: u32,
}

/// A known number of whose squares others leave less than this is told by them.
const LEAST_PIVOT: f64 = 1e-9;

impl<const K: usize> Plane<K> {
    /// Through a sample.
    pub fn through(sample: &[Sample<K>]) -> Plane<K> {
        let mean = centre(sample);
        let away = |(known, _): &Sample<K>, k: usize| known[k] - mean.0[k];
        let sum = |of: &dyn Fn(&Sample<K>) -> f64| sample.iter().map(of).sum::<f64>();
        let products =
            std::array::from_fn(|i| std::array::from_fn(|k| sum(&|sample| away(sample, i) * away(sample, k))));
        let with_value: [f64; K] = std::array::from_fn(|k| sum(&|sample| away(sample, k) * (sample.1 - mean.1)));
        let (inverse, used) = inverted(products);
        let slopes = std::array::from_fn(|i| (0..K).map(|k| inverse[i][k] * with_value[k]).sum());
        Plane { mean, slopes, inverse, used }
    }

    /// The value where this is known.
    pub fn at(&self, known: [f64; K]) -> f64 {
        self.mean.1 + (0..K).map(|k| self.slopes[k] * (known[k] - self.mean.0[k])).sum::<f64>()
    }

    /// How much of the values' variance the slopes carry to `known`.
    fn lever(&self, known: [f64; K]) -> f64 {
        let away = |k: usize| known[k] - self.mean.0[k];
        (0..K).flat_map(|i| (0..K).map(move |k| (i, k))).map(|(i, k)| away(i) * self.inverse[i][k] * away(k)).sum()
    }
}

/// The inverse of a symmetric matrix with rows and columns left out, 0, that depend on those before them; and how many are
/// left. By sweeps (Goodnight 1979).
fn inverted<const K: usize>(matrix: [[f64; K]; K]) -> ([[f64; K]; K], u32) {
    let mut swept = matrix;
    let mut used = [false; K];
    for pivot in 0..K {
        let with = swept[pivot][pivot];
        if with <= LEAST_PIVOT * matrix[pivot][pivot] {
            continue;
        }
        used[pivot] = true;
        let before = swept;
        for (i, row) in swept.iter_mut().enumerate() {
            for (k, entry) in row.iter_mut().enumerate() {
                *entry = match (i == pivot, k == pivot) {
                    (true, true) => 1.0 / with,
                    (true, false) => before[i][k] / with,
                    (false, true) => -before[i][k] / with,
                    (false, false) => before[i][k] - before[i][pivot] * before[pivot][k] / with,
                };
            }
        }
    }
    let inverse = std::array::from_fn(|i| std::array::from_fn(|k| if used[i] && used[k] { swept[i][k] } else { 0.0 }));
    (inverse, used.iter().filter(|used| **used).count() as u32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::procedural::random::Random;

    #[test]
    fn a_line_and_its_interval_are_as_by_hand() {
        // y = 1 + 2 x with residuals 1, -2, 1 at x = 0, 1, 2; variance 6 / 1.
        let sample = [([0.0], 2.0), ([1.0], 1.0), ([2.0], 6.0)];
        let many = f64::INFINITY;
        let estimate = regression(&sample, [4.0], many, 0.95).unwrap();
        assert!((estimate.value - 9.0).abs() < 1e-12);
        // 12.706 for one degree of freedom; 1 / 3 and (4 - 1)^2 / 2.
        let half = 12.706 * (6.0 * (1.0 / 3.0 + 4.5f64)).sqrt();
        assert!((estimate.interval[1] - 9.0 - half).abs() < 1e-2, "{estimate:?}");
        assert_eq!(regression(&sample[..2], [4.0], many, 0.95), None);
        let level = regression(&[([1.0], 4.0), ([1.0], 6.0), ([1.0], 5.0)], [9.0], many, 0.95).unwrap();
        assert!((level.value - 5.0).abs() < 1e-12);
    }

    #[test]
    fn a_plane_is_found_and_what_tells_nothing_new_is_left_out() {
        let points = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [2.0, 3.0], [4.0, 1.0]];
        let plane = Plane::through(&points.map(|[x, y]| ([x, y], 1.0 + 2.0 * x - 3.0 * y)));
        assert!((plane.at([10.0, 5.0]) - 6.0).abs() < 1e-9 && plane.used == 2);
        let doubled = Plane::through(&points.map(|[x, _]| ([x, 2.0 * x], 1.0 + 2.0 * x)));
        assert!((doubled.at([10.0, 20.0]) - 21.0).abs() < 1e-9 && doubled.used == 1);
        // A line has the same lever with a further number that does not vary.
        let line = Plane::through(&points.map(|[x, y]| ([x], y)));
        let further = Plane::through(&points.map(|[x, y]| ([x, 7.0], y)));
        assert!((line.lever([9.0]) - further.lever([9.0, 8.0])).abs() < 1e-12);
    }

    #[test]
    fn intervals_hold_the_rest_of_a_population_as_often_as_they_say() {
        let holds = |seed: u64| {
            let mut random = Random::new(seed);
            let all: Vec<Sample<2>> = (0..20)
                .map(|_| {
                    let (x, y) = (f64::from(random.unit()), f64::from(random.unit()));
                    let noise: f32 = (0..4).map(|_| random.unit() - 0.5).sum();
                    ([x, y], 3.0 + 2.0 * x + y + f64::from(noise))
                })
                .collect();
            let (sample, rest) = all.split_at(8);
            let mean = |of: &dyn Fn(&Sample<2>) -> f64| rest.iter().map(of).sum::<f64>() / 12.0;
            let at = [0, 1].map(|k| mean(&|(known, _)| known[k]));
            regression(sample, at, 12.0, 0.95).unwrap().holds(mean(&|(_, value)| *value))
        };
        let held = (0..1000).filter(|&seed| holds(seed)).count();
        assert!((930..=970).contains(&held), "{held} of 1000");
    }
}
