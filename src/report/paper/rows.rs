//! Tables II and III: miss rates and cycles of the standard traversal and of migration.

use serde::Serialize;

use super::jobs::{Job, Predictions};
use super::{RAYS, Request, published, scenes};
use crate::fermi::result::{Accounting, Prediction};
use crate::render::rays::Batch;
use crate::report::experiment::Migrate;

/// A row of Tables II and III.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// The paper's name of the scene.
    pub scene: &'static str,
    /// `primary` or `secondary`.
    pub rays: &'static str,
    /// Rays traced.
    pub ray_count: u64,
    /// Misses an L1 access, standard.
    pub miss_standard: f64,
    /// The same with migration, in the paper's accounting.
    pub miss_improved: f64,
    /// Improved over standard.
    pub miss_ratio: f64,
    /// Improved over standard, where a hit on a line under way is a miss.
    pub miss_ratio_pending: f64,
    /// Cycles, standard.
    pub cycles_standard: u64,
    /// Cycles with migration, in the paper's accounting.
    pub cycles_improved: u64,
    /// Improved over standard.
    pub cycle_ratio: f64,
    /// Miss rate with migration, everything charged.
    pub full_miss: f64,
    /// Cycles with migration, everything charged.
    pub full_cycles: u64,
    /// Those over standard.
    pub full_cycle_ratio: f64,
    /// The paper's own numbers.
    pub paper: published::Row,
    /// The paper's ratio of miss rates.
    pub paper_miss_ratio: f64,
    /// The paper's ratio of cycles.
    pub paper_cycle_ratio: f64,
}

/// Mean absolute difference of eight ratios to the paper's.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Difference {
    /// Of miss rates.
    pub miss: f64,
    /// Of miss rates, where a hit on a line under way is a miss.
    pub miss_pending: f64,
    /// Of cycles.
    pub cycles: f64,
}

/// All that the eight rows depend on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Setting {
    pub(super) size: (u32, u32),
    pub(super) secondary: Batch,
    pub(super) migrate: Migrate,
}

/// The runs of a row.
#[derive(Clone, Copy, Debug)]
pub(super) struct RowJobs {
    kind: usize,
    pub(super) standard: Job,
    pub(super) improved: Job,
    pub(super) full: Job,
}

impl Setting {
    pub(super) fn of(request: &Request) -> Setting {
        Setting { size: request.size, secondary: request.secondary, migrate: request.migrate }
    }

    pub(super) fn rows(&self) -> impl Iterator<Item = RowJobs> {
        let Setting { size, secondary, migrate } = *self;
        let batches = scenes::batches(secondary);
        (0..RAYS.len()).flat_map(move |kind| {
            (0..published::SCENES.len()).map(move |subject| {
                let standard = Job { subject, batch: batches[kind], size, migrate: None, sms: None };
                let with = |accounting| Job { migrate: Some(Migrate { accounting, ..migrate }), ..standard };
                RowJobs { kind, standard, improved: with(Accounting::Paper), full: with(Accounting::Full) }
            })
        })
    }

    pub(super) fn difference(&self, predictions: &Predictions) -> Difference {
        let mut sum = Difference { miss: 0.0, miss_pending: 0.0, cycles: 0.0 };
        let share = 1.0 / (RAYS.len() * published::SCENES.len()) as f64;
        for row in self.rows() {
            let (paper, ratios) = (row.paper(), row.ratios(predictions));
            sum.miss += share * (ratios.miss - paper.miss_ratio()).abs();
            sum.miss_pending += share * (ratios.miss_pending - paper.miss_ratio()).abs();
            sum.cycles += share * (ratios.cycles - paper.cycle_ratio()).abs();
        }
        sum
    }
}

impl RowJobs {
    fn paper(&self) -> published::Row {
        published::ROWS[self.kind][self.standard.subject]
    }

    /// Improved over standard.
    pub(super) fn ratios(&self, predictions: &Predictions) -> Difference {
        let (standard, improved) = (predictions.get(&self.standard), predictions.get(&self.improved));
        Difference {
            miss: ratio(improved.l1.miss_rate, standard.l1.miss_rate),
            miss_pending: ratio(with_pending(improved), with_pending(standard)),
            cycles: ratio(improved.cycles as f64, standard.cycles as f64),
        }
    }

    pub(super) fn of(&self, predictions: &Predictions) -> Row {
        let [standard, improved, full] = [&self.standard, &self.improved, &self.full].map(|job| predictions.get(job));
        let (ratios, paper) = (self.ratios(predictions), self.paper());
        Row {
            scene: published::SCENES[self.standard.subject].name,
            rays: RAYS[self.kind],
            ray_count: standard.rays,
            miss_standard: standard.l1.miss_rate,
            miss_improved: improved.l1.miss_rate,
            miss_ratio: ratios.miss,
            miss_ratio_pending: ratios.miss_pending,
            cycles_standard: standard.cycles,
            cycles_improved: improved.cycles,
            cycle_ratio: ratios.cycles,
            full_miss: full.l1.miss_rate,
            full_cycles: full.cycles,
            full_cycle_ratio: ratio(full.cycles as f64, standard.cycles as f64),
            paper,
            paper_miss_ratio: paper.miss_ratio(),
            paper_cycle_ratio: paper.cycle_ratio(),
        }
    }
}

/// Quotient; 1 where there was nothing to begin with.
fn ratio(a: f64, b: f64) -> f64 {
    if b > 0.0 { a / b } else { 1.0 }
}

/// Misses an access, where a hit on a line under way is one.
fn with_pending(prediction: &Prediction) -> f64 {
    let counts = prediction.l1.counts;
    (counts.misses + counts.pending_hits) as f64 / counts.accesses.max(1) as f64
}
