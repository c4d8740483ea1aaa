//! How the ratios depend on what the paper leaves open: one setting changed at a time.

use serde::Serialize;

use super::Request;
use super::jobs::Predictions;
use super::rows::{Difference, Setting};
use crate::bvh::Policy;
use crate::fermi::plan::Grouping;
use crate::render::rays::{Batch, RayKind};
use crate::report::experiment::Migrate;

/// Results with one setting changed.
#[derive(Clone, Debug, Serialize)]
pub struct Sensitivity {
    /// What was changed.
    pub setting: &'static str,
    /// To what.
    pub value: String,
    /// Mean absolute difference to the paper's ratios.
    pub difference: Difference,
    /// The ratios of miss rates, in the order of the rows.
    pub miss_ratios: Vec<f64>,
    /// The ratios of cycles.
    pub cycle_ratios: Vec<f64>,
}

/// A setting changed.
pub(super) struct Variation {
    name: &'static str,
    value: String,
    pub(super) setting: Setting,
}

/// Cuts from few subtrees to many.
const PARTITIONS: [Policy; 6] = [
    Policy::Level(4),
    Policy::Level(8),
    Policy::Level(12),
    Policy::Bytes(1 << 20),
    Policy::Bytes(256 << 10),
    Policy::Bytes(16 << 10),
];

/// Secondary rays a hit.
const PER_HIT: [u32; 3] = [1, 3, 8];

/// Each setting that the paper leaves open, changed alone.
pub(super) fn variations(request: &Request) -> Vec<Variation> {
    let base = Setting::of(request);
    let mut all = Vec::new();
    let mut add = |name, value: String, setting| all.push(Variation { name, value, setting });
    add("as in the tables", "-".to_owned(), base);
    for partition in PARTITIONS {
        add("subtrees", partition.to_string(), Setting { migrate: Migrate { partition, ..base.migrate }, ..base });
    }
    for grouping in [Grouping::Launched, Grouping::Queued, Grouping::Owned] {
        let value = format!("{grouping:?}").to_lowercase();
        add("rays that run together", value, Setting { migrate: Migrate { grouping, ..base.migrate }, ..base });
    }
    for kind in [RayKind::Diffuse, RayKind::Reflect, RayKind::Ao] {
        let secondary = Batch { kind, ..base.secondary };
        add("secondary rays", kind.name().to_owned(), Setting { secondary, ..base });
    }
    for per_hit in PER_HIT {
        let secondary = Batch { per_hit, ..base.secondary };
        add("secondary rays a hit", per_hit.to_string(), Setting { secondary, ..base });
    }
    let sorted = !base.secondary.sorted;
    let secondary = Batch { sorted, ..base.secondary };
    add("secondary rays sorted", if sorted { "yes" } else { "no" }.to_owned(), Setting { secondary, ..base });
    for (n, d) in [(1, 2), (5, 4)] {
        let size = ((base.size.0 * n / d).max(1), (base.size.1 * n / d).max(1));
        add("resolution", format!("{} x {}", size.0, size.1), Setting { size, ..base });
    }
    all
}

impl Variation {
    pub(super) fn result(&self, predictions: &Predictions) -> Sensitivity {
        let ratios: Vec<Difference> = self.setting.rows().map(|row| row.ratios(predictions)).collect();
        Sensitivity {
            setting: self.name,
            value: self.value.clone(),
            difference: self.setting.difference(predictions),
            miss_ratios: ratios.iter().map(|ratio| ratio.miss).collect(),
            cycle_ratios: ratios.iter().map(|ratio| ratio.cycles).collect(),
        }
    }
}
