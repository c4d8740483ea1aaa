//! Zhu and Deng 2013, table by table and figure by figure, beside what this project predicts.

mod charts;
mod clusters;
mod jobs;
mod page;
pub mod published;
mod rows;
mod scenes;
mod sensitivity;

use std::path::PathBuf;
use std::time::Instant;

use serde::Serialize;

pub use charts::charts;
pub use clusters::Cluster;
pub use page::{csv, page, text};
pub use rows::{Difference, Row};
pub use scenes::SceneRow;

use super::experiment::{Migrate, Model};
use crate::Result;
use crate::bvh::{Policy, Quality};
use crate::fermi::sampled;
use crate::render::rays::{Batch, RayKind};
use jobs::{Job, Predictions, Used};
use rows::Setting;
use scenes::Subject;
use sensitivity::Sensitivity;

/// Version of the JSON.
pub const SCHEMA: &str = "caribou-paper/1";

/// The two kinds of rows.
const RAYS: [&str; 2] = ["primary", "secondary"];

/// Pixels across and down by default; together with the next two a choice among what the paper leaves open.
pub const SIZE: (u32, u32) = (160, 120);
/// Secondary rays by default: with these, secondary runs take 2 to 10 times the cycles of primary ones, as the paper's.
pub const SECONDARY: Batch = Batch { kind: RayKind::Diffuse, per_hit: 6, sorted: false };
/// Where the tree is cut by default.
pub const PARTITION: Policy = Policy::Bytes(128 << 10);

/// What is asked for.
#[derive(Clone, Debug, Serialize)]
pub struct Request {
    /// Folder of scenes.
    #[serde(skip)]
    pub scenes: Option<PathBuf>,
    /// Pixels across and down.
    pub size: (u32, u32),
    /// The secondary rays.
    pub secondary: Batch,
    /// Strategy `migrate`; its accounting is tried both ways.
    pub migrate: Migrate,
    /// Machine, kernels and fidelity.
    #[serde(flatten)]
    pub model: Model,
    /// What is asked of fidelity `sampled`.
    #[serde(skip)]
    pub sampling: Option<sampled::Request>,
    /// Preset of the BVH builder.
    #[serde(skip)]
    pub quality: Quality,
    /// Whether to show how results depend on what the paper leaves open.
    #[serde(skip)]
    pub sensitivity: bool,
}

/// All of it.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// [`SCHEMA`].
    pub schema: &'static str,
    /// Version of the program.
    pub version: &'static str,
    /// What was asked for.
    #[serde(flatten)]
    pub request: Request,
    /// How its runs were predicted.
    pub used: Vec<Used>,
    /// Table I.
    pub scenes: Vec<SceneRow>,
    /// Tables II and III.
    pub rows: Vec<Row>,
    /// Mean absolute difference of the ratios of `rows` to the paper's.
    pub difference: Difference,
    /// Figures 2 to 4.
    pub clusters: Vec<Cluster>,
    /// How `difference` depends on what the paper leaves open.
    pub sensitivity: Vec<Sensitivity>,
    /// What the paper leaves open.
    pub open: [&'static str; published::OPEN.len()],
    /// Seconds that it took.
    pub seconds: f64,
}

/// Predicts everything; `done` hears of runs finished and of runs in all.
///
/// # Errors
/// As of loading scenes, and of kernels that do not fit the machine.
pub fn measure(request: &Request, done: &(dyn Fn(usize, usize) + Sync)) -> Result<Report> {
    let start = Instant::now();
    let subjects = subjects(request)?;
    let main = Setting::of(request);
    let mut jobs: Vec<Job> = main.rows().flat_map(|row| [row.standard, row.improved, row.full]).collect();
    jobs.extend(clusters::jobs(request).map(|(_, job)| job));
    let variations = if request.sensitivity { sensitivity::variations(request) } else { Vec::new() };
    jobs.extend(
        variations.iter().flat_map(|variation| variation.setting.rows()).flat_map(|row| [row.standard, row.improved]),
    );
    let predictions = Predictions::of(request, &subjects, jobs, done)?;
    let cluster = |(rays, job): (&'static str, Job)| Cluster::of(rays, &job, predictions.get(&job));
    Ok(Report {
        schema: SCHEMA,
        version: env!("CARGO_PKG_VERSION"),
        request: request.clone(),
        used: predictions.used(),
        scenes: subjects.iter().map(SceneRow::of).collect(),
        rows: main.rows().map(|row| row.of(&predictions)).collect(),
        difference: main.difference(&predictions),
        clusters: clusters::jobs(request).map(cluster).collect(),
        sensitivity: variations.iter().map(|variation| variation.result(&predictions)).collect(),
        open: published::OPEN,
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// Mean absolute difference of the eight ratios to the paper's, in the paper's accounting, and nothing else.
///
/// # Errors
/// As of [`measure`].
pub fn difference(request: &Request) -> Result<Difference> {
    let subjects = subjects(request)?;
    let main = Setting::of(request);
    let jobs = main.rows().flat_map(|row| [row.standard, row.improved]).collect();
    Ok(main.difference(&Predictions::of(request, &subjects, jobs, &|_, _| ())?))
}

fn subjects(request: &Request) -> Result<Vec<Subject>> {
    (0..published::SCENES.len()).map(|index| Subject::find(index, request.scenes.as_deref(), request.quality)).collect()
}
