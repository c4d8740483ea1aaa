//! Estimates with intervals from samples of clusters: rays of a warp resemble each other, so that the warp, not the
//! ray, is what a sample consists of. Pure.

mod clusters;
mod proportional;
mod regression;
mod student;

pub use clusters::{bootstrap_t, student_t};
pub use proportional::Design;
pub use regression::{Plane, Sample, centre, regression};
pub use student::quantile;

/// The usual confidence.
pub const CONFIDENCE: f64 = 0.95;

/// An estimate and its interval.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Estimate {
    /// The estimate.
    pub value: f64,
    /// Low and high end.
    pub interval: [f64; 2],
}

impl Estimate {
    /// Whether the interval holds `truth`.
    pub fn holds(&self, truth: f64) -> bool {
        (self.interval[0]..=self.interval[1]).contains(&truth)
    }

    /// Half the interval's width.
    pub fn half(&self) -> f64 {
        0.5 * (self.interval[1] - self.interval[0])
    }

    /// In another unit, of which there are `factor` to one.
    pub fn scaled(&self, factor: f64) -> Estimate {
        Estimate { value: self.value * factor, interval: self.interval.map(|end| end * factor) }
    }

    /// With a further error whose interval is `half` wide to each side and which is independent of it.
    pub fn widened(&self, half: f64) -> Estimate {
        let [low, high] = self.interval.map(|end| (end - self.value).hypot(half));
        Estimate { value: self.value, interval: [self.value - low, self.value + high] }
    }

    /// With what cannot be left out.
    pub fn within(&self, low: f64, high: f64) -> Estimate {
        Estimate { value: self.value.clamp(low, high), interval: self.interval.map(|end| end.clamp(low, high)) }
    }

    /// Half the interval's width as a part of the estimate; infinite for an estimate of 0 that is not certain.
    pub fn relative_error(&self) -> f64 {
        let half = self.half();
        if half == 0.0 { 0.0 } else { half / self.value.abs() }
    }
}

/// Mean, and variance of one value with divisor n - 1; the variance is 0 for fewer than two.
fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n.max(1.0);
    let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    (mean, if values.len() < 2 { 0.0 } else { squares / (n - 1.0) })
}
