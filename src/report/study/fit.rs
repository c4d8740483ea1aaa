//! Power laws fitted to measurements.

use serde::Serialize;

use crate::statistics::{CONFIDENCE, quantile};

/// An exponent of a power law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Exponent {
    /// The exponent.
    pub exponent: f64,
    /// Its 95 % interval; none for fewer than three points. Measured values scatter little: it tells how well a
    /// power law describes them.
    pub interval: Option<[f64; 2]>,
}

impl Exponent {
    /// Slope of a line through the logarithms of `points` by least squares, with the usual interval (Draper and Smith
    /// 1998, section 1.4). None unless two points of positive numbers differ in x.
    pub fn of(points: &[(f64, f64)]) -> Option<Exponent> {
        let logs: Vec<(f64, f64)> =
            points.iter().filter(|(x, y)| *x > 0.0 && *y > 0.0).map(|(x, y)| (x.ln(), y.ln())).collect();
        let n = logs.len() as f64;
        let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / n;
        let (x, y) = (mean(|p| p.0), mean(|p| p.1));
        let spread: f64 = logs.iter().map(|p| (p.0 - x).powi(2)).sum();
        if logs.is_empty() || spread == 0.0 {
            return None;
        }
        let exponent = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / spread;
        let interval = logs.len().checked_sub(2).filter(|&freedom| freedom > 0).map(|freedom| {
            let residuals: f64 = logs.iter().map(|p| (p.1 - y - exponent * (p.0 - x)).powi(2)).sum();
            let t = quantile(CONFIDENCE, freedom as u32);
            let half = t * (residuals / freedom as f64 / spread).sqrt();
            [exponent - half, exponent + half]
        });
        Some(Exponent { exponent, interval })
    }

    /// For people.
    pub fn text(&self) -> String {
        let half = self.interval.map_or(String::new(), |[low, high]| format!(" ± {:.2}", 0.5 * (high - low)));
        // No sign for what is shown as zero.
        let exponent = (100.0 * self.exponent).round() / 100.0 + 0.0;
        format!("{exponent:.2}{half}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_gives_its_exponent_and_a_narrow_interval() {
        let points: Vec<(f64, f64)> = [1e3, 1e4, 1e5, 1e6].map(|x: f64| (x, 7.0 * x.powf(1.25))).into();
        let found = Exponent::of(&points).unwrap();
        let [low, high] = found.interval.unwrap();
        assert!((found.exponent - 1.25).abs() < 1e-12 && high - low < 1e-6, "{found:?}");
    }

    #[test]
    fn the_interval_is_that_of_the_textbook() {
        // ln y = 0, 1, 1, 3 at ln x = 0, 1, 2, 3: slope 0.9, residual sum 0.7, so t(2) sqrt(0.7 / 2 / 5) = 1.138.
        let points = [(0.0, 0.0), (1.0, 1.0), (2.0, 1.0), (3.0, 3.0f64)].map(|(x, y): (f64, f64)| (x.exp(), y.exp()));
        let found = Exponent::of(&points).unwrap();
        let [low, high] = found.interval.unwrap();
        assert!((found.exponent - 0.9).abs() < 1e-12, "{found:?}");
        assert!((high - low - 2.0 * 4.303 * 0.07f64.sqrt()).abs() < 1e-3, "{found:?}");
    }

    #[test]
    fn nothing_grows_by_minus_zero() {
        let text = |exponent| Exponent { exponent, interval: None }.text();
        assert_eq!([text(-0.001), text(-0.25), text(1.0)], ["0.00", "-0.25", "1.00"]);
    }

    #[test]
    fn too_few_points_have_no_interval_or_no_exponent() {
        assert_eq!(Exponent::of(&[]), None);
        assert_eq!(Exponent::of(&[(2.0, 3.0), (2.0, 5.0)]), None);
        assert_eq!(Exponent::of(&[(1.0, 0.0), (2.0, 5.0)]), None);
        let two = Exponent::of(&[(1.0, 1.0), (10.0, 100.0)]).unwrap();
        assert!((two.exponent - 2.0).abs() < 1e-12 && two.interval.is_none());
    }
}
