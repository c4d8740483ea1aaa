//! Methods driven to where they fail, the usual one beside the one that this program uses. Everything runs on the CPU
//! twin, which gives the bits of every device.

mod boxes;
mod caches;
mod contention;
mod distance;
mod intervals;
pub mod naive;
mod overflow;
mod quantised;
mod queues;
mod self_intersection;
mod shapes;
mod stack;
mod triangle;

#[cfg(test)]
mod tests;

use serde::Serialize;

use crate::Result;
use crate::report::chart::Chart;

/// How much is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Seconds.
    Quick,
    /// A minute or two.
    Full,
}

impl Effort {
    /// A sample's size.
    fn of(self, quick: usize, full: usize) -> usize {
        match self {
            Effort::Quick => quick,
            Effort::Full => full,
        }
    }
}

/// A row of the table: where the usual method fails and by how much.
#[derive(Clone, Debug, Serialize)]
pub struct Finding {
    /// What is computed.
    pub method: &'static str,
    /// Where the usual method fails.
    pub regime: String,
    /// What was measured.
    pub measure: &'static str,
    /// The usual method.
    pub naive: &'static str,
    /// What it comes to.
    pub naive_failure: f64,
    /// The same measure of what this program does.
    pub failure: f64,
    /// What this program uses, and where it is.
    pub uses: &'static str,
}

/// A method driven to where it fails.
pub struct Study {
    /// What is computed, and how it was driven.
    pub about: &'static str,
    /// Rows of the table.
    pub findings: Vec<Finding>,
    /// The failures over the regime.
    pub charts: Vec<Chart>,
}

/// A method's name and what drives it.
pub type Driver = (&'static str, fn(Effort) -> Result<Study>);

/// All methods, in the order of the report.
pub const STUDIES: [Driver; 11] = [
    ("triangle test", triangle::study),
    ("distance", distance::study),
    ("ray offset", self_intersection::study),
    ("box test", boxes::study),
    ("quantised nodes", quantised::study),
    ("stack and trail", stack::study),
    ("contention", contention::study),
    ("intervals", intervals::study),
    ("cache mapping", caches::study),
    ("queues", queues::study),
    ("counters and timers", overflow::study),
];

/// Part of `count` cases for which `fails`, in parallel.
fn rate(count: usize, fails: impl Fn(u64) -> bool + Sync) -> f64 {
    use rayon::prelude::*;
    (0..count as u64).into_par_iter().filter(|&i| fails(i)).count() as f64 / count.max(1) as f64
}

/// Largest y of a curve.
fn worst(points: &[(f64, f64)]) -> f64 {
    points.iter().map(|point| point.1).fold(0.0, f64::max)
}
