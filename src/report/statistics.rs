//! Median and interval of repeated measurements.

use serde::{Deserialize, Serialize};

/// A median with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Median {
    /// The median.
    pub median: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
}

impl Median {
    /// Of at least one value. The interval is distribution-free: the narrowest pair of order statistics
    /// that covers the median with 95 % (Hahn and Meeker 1991, section 5.2); below 6 values no pair does,
    /// and it is all of them.
    pub fn of(values: &[f64]) -> Option<Median> {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len();
        let middle = [*sorted.get(n.checked_sub(1)? / 2)?, sorted[n / 2]];
        let rank = interval_rank(n);
        Some(Median { median: 0.5 * (middle[0] + middle[1]), low: sorted[rank], high: sorted[n - 1 - rank] })
    }
}

/// Largest k for which the (k+1)-th smallest and largest of `n` values still cover: the chance that fewer
/// than k + 1 of n fall on one side of the median is at most 2.5 %.
fn interval_rank(n: usize) -> usize {
    let mut chance = 0.5f64.powi(n as i32);
    let mut tail = 0.0;
    for k in 0..n / 2 {
        tail += chance;
        if tail > 0.025 {
            return k.saturating_sub(1);
        }
        chance *= (n - k) as f64 / (k + 1) as f64;
    }
    (n / 2).saturating_sub(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_and_intervals_of_known_samples() {
        assert_eq!(Median::of(&[]), None);
        assert_eq!(Median::of(&[3.0]), Some(Median { median: 3.0, low: 3.0, high: 3.0 }));
        assert_eq!(Median::of(&[4.0, 1.0, 3.0, 2.0]), Some(Median { median: 2.5, low: 1.0, high: 4.0 }));
        // Binomial(9, 1/2): P(X <= 1) = 10 / 512 = 1.95 %, P(X <= 2) = 9 %: ranks 2 and 8.
        let nine: Vec<f64> = (1..=9).map(f64::from).collect();
        assert_eq!(Median::of(&nine), Some(Median { median: 5.0, low: 2.0, high: 8.0 }));
    }
}
