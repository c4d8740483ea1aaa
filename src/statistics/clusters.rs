//! Intervals for the mean of clusters of which some were drawn at random.

use super::{Estimate, moments, quantile};
use crate::scene::procedural::random::Random;

/// Student's interval. `None` for fewer than two values.
pub fn student_t(values: &[f64], confidence: f64) -> Option<Estimate> {
    let (mean, variance) = moments(values);
    let n = values.len();
    let half =
        quantile(confidence, (n as u32).checked_sub(1).filter(|freedom| *freedom > 0)?) * (variance / n as f64).sqrt();
    Some(Estimate { value: mean, interval: [mean - half, mean + half] })
}

/// The bootstrap-t interval (Efron and Tibshirani 1993, section 12.5): quantiles of t come from `resamples` of the
/// sample itself, so that a skewed distribution gets a longer upper arm. `None` for fewer than two values.
pub fn bootstrap_t(values: &[f64], confidence: f64, resamples: usize, seed: u64) -> Option<Estimate> {
    let n = values.len();
    if n < 2 {
        return None;
    }
    let (mean, variance) = moments(values);
    let error = (variance / n as f64).sqrt();
    let mut random = Random::new(seed);
    let mut again = vec![0.0; n];
    let mut ts: Vec<f64> = (0..resamples)
        .filter_map(|_| {
            again.iter_mut().for_each(|value| *value = random.pick(values));
            let (other, variance) = moments(&again);
            // A resample of one value again and again has no t.
            (variance > 0.0).then(|| (other - mean) / (variance / n as f64).sqrt())
        })
        .collect();
    if ts.is_empty() {
        return Some(Estimate { value: mean, interval: [mean, mean] });
    }
    ts.sort_by(f64::total_cmp);
    let at = |p: f64| ts[((p * ts.len() as f64) as usize).min(ts.len() - 1)];
    let tail = 0.5 * (1.0 - confidence);
    Some(Estimate { value: mean, interval: [mean - at(1.0 - tail) * error, mean - at(tail) * error] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn student_s_interval_is_as_by_hand() {
        assert_eq!(student_t(&[], 0.95), None);
        assert_eq!(student_t(&[1.0], 0.95), None);
        // Mean 2, standard error 1 / sqrt 3, 4.303 for two degrees of freedom.
        let estimate = student_t(&[1.0, 2.0, 3.0], 0.95).unwrap();
        assert_eq!(estimate.value, 2.0);
        assert!((estimate.interval[1] - (2.0 + 4.303 / 3f64.sqrt())).abs() < 1e-3);
        assert_eq!(student_t(&[5.0; 4], 0.95).unwrap().interval, [5.0, 5.0]);
    }

    #[test]
    fn the_bootstrap_leans_towards_the_tail() {
        assert_eq!(bootstrap_t(&[1.0], 0.95, 100, 1), None);
        assert_eq!(bootstrap_t(&[5.0; 4], 0.95, 100, 1).unwrap().interval, [5.0, 5.0]);
        let skewed: Vec<f64> = (0..40).map(|i| if i % 8 == 0 { 20.0 } else { 1.0 }).collect();
        let Estimate { value, interval } = bootstrap_t(&skewed, 0.95, 2000, 1).unwrap();
        assert!(
            interval[0] < value && interval[1] - value > 1.2 * (value - interval[0]),
            "{interval:?} around {value}"
        );
    }
}
