//! Zhu and Deng 2013, table by table and figure by figure, beside what this project predicts.

mod charts;
mod jobs;
mod page;
pub mod published;
mod scenes;
mod sensitivity;

use std::path::PathBuf;
use std::time::Instant;

use serde::Serialize;

pub use charts::charts;
pub use page::{csv, page, text};

use super::experiment::{Migrate, Model};
use crate::Result;
use crate::bvh::{Policy, Quality};
use crate::fermi::result::{Accounting, Prediction};
use crate::render::rays::{Batch, RayKind};
use jobs::{Job, Predictions};
use scenes::Subject;
use sensitivity::Sensitivity;

/// Version of the JSON.
pub const SCHEMA: &str = "caribou-paper/1";

/// Most multiprocessors of figures 2 to 4.
const CLUSTERS: u32 = 15;

/// Pixels across and down by default; together with the next two a choice among what the paper leaves open.
pub const SIZE: (u32, u32) = (160, 120);
/// Secondary rays by default: with these, secondary runs take 2 to 10 times the cycles of primary ones, as the paper's.
pub const SECONDARY: Batch = Batch { kind: RayKind::Diffuse, per_hit: 6, sorted: false };
/// Where the tree is cut by default.
pub const PARTITION: Policy = Policy::Bytes(128 << 10);

/// What is asked for.
#[derive(Clone, Debug)]
pub struct Request {
    /// Folder of scenes.
    pub scenes: Option<PathBuf>,
    /// Pixels across and down.
    pub size: (u32, u32),
    /// The secondary rays.
    pub secondary: Batch,
    /// Strategy `migrate`; its accounting is tried both ways.
    pub migrate: Migrate,
    /// Machine, kernels and fidelity.
    pub model: Model,
    /// Preset of the BVH builder.
    pub quality: Quality,
    /// Whether to show how results depend on what the paper leaves open.
    pub sensitivity: bool,
}

/// All of it.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// [`SCHEMA`].
    pub schema: &'static str,
    /// Version of the program.
    pub version: &'static str,
    /// Machine of the model.
    pub machine: String,
    /// Kernel of the standard traversal.
    pub kernel: String,
    /// Fidelity of the model.
    pub fidelity: crate::fermi::result::Fidelity,
    /// Pixels across and down.
    pub size: (u32, u32),
    /// The secondary rays.
    pub secondary: Batch,
    /// Where the tree is cut.
    pub partition: String,
    /// Which rays run together in the paper's accounting.
    pub grouping: crate::fermi::plan::Grouping,
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

/// A scene: Table I.
#[derive(Clone, Debug, Serialize)]
pub struct SceneRow {
    /// The paper's.
    pub paper: published::Scene,
    /// The file or procedural scene.
    pub source: String,
    /// How it differs from the paper's, if it does.
    pub stand_in: Option<String>,
    /// Distinct corners of its triangles.
    pub vertices: usize,
    /// Triangles.
    pub triangles: usize,
    /// Inner nodes of its BVH.
    pub nodes: usize,
    /// Leaves with triangles.
    pub leaves: usize,
    /// Bytes of nodes and triangles.
    pub bytes: usize,
}

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

/// The conference room on a number of multiprocessors: figures 2 to 4.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Cluster {
    /// Multiprocessors.
    pub sms: u32,
    /// `primary` or `secondary`.
    pub rays: &'static str,
    /// Million rays a second.
    pub mrays_per_s: f64,
    /// Mean cycles from an L1 miss to its line.
    pub latency: f64,
    /// Misses an L1 access.
    pub l1_miss: f64,
    /// Misses an L2 access.
    pub l2_miss: f64,
}

/// The two kinds of rows.
const RAYS: [&str; 2] = ["primary", "secondary"];

/// Predicts everything; `done` hears of runs finished and of runs in all.
///
/// # Errors
/// As of loading scenes, and of kernels that do not fit the machine.
pub fn measure(request: &Request, done: &(dyn Fn(usize, usize) + Sync)) -> Result<Report> {
    let start = Instant::now();
    let subjects = subjects(request)?;
    let main = Setting::of(request);
    let mut jobs: Vec<Job> = main.rows().flat_map(|row| [row.standard, row.improved, row.full]).collect();
    jobs.extend(cluster_jobs(request).map(|(_, job)| job));
    let variations = if request.sensitivity { sensitivity::variations(request) } else { Vec::new() };
    jobs.extend(
        variations.iter().flat_map(|variation| variation.setting.rows()).flat_map(|row| [row.standard, row.improved]),
    );
    let predictions = Predictions::of(&request.model, &subjects, jobs, done)?;

    let rows: Vec<Row> = main.rows().map(|row| row.of(&predictions)).collect();
    Ok(Report {
        schema: SCHEMA,
        version: env!("CARGO_PKG_VERSION"),
        machine: request.model.machine.name.clone(),
        kernel: request.model.kernel.name.clone(),
        fidelity: request.model.fidelity,
        size: request.size,
        secondary: request.secondary,
        partition: request.migrate.partition.to_string(),
        grouping: request.migrate.grouping,
        scenes: subjects.iter().map(scene_row).collect(),
        difference: main.difference(&predictions),
        rows,
        clusters: cluster_jobs(request).map(|(rays, job)| cluster(rays, &job, predictions.get(&job))).collect(),
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
    Ok(main.difference(&Predictions::of(&request.model, &subjects, jobs, &|_, _| ())?))
}

fn subjects(request: &Request) -> Result<Vec<Subject>> {
    (0..published::SCENES.len()).map(|index| Subject::find(index, request.scenes.as_deref(), request.quality)).collect()
}

/// All that the eight rows depend on.
#[derive(Clone, Copy, Debug)]
struct Setting {
    size: (u32, u32),
    secondary: Batch,
    migrate: Migrate,
}

/// The runs of a row.
#[derive(Clone, Copy, Debug)]
struct RowJobs {
    kind: usize,
    standard: Job,
    improved: Job,
    full: Job,
}

impl Setting {
    fn of(request: &Request) -> Setting {
        Setting { size: request.size, secondary: request.secondary, migrate: request.migrate }
    }

    fn rows(&self) -> impl Iterator<Item = RowJobs> {
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

    fn difference(&self, predictions: &Predictions) -> Difference {
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
    fn ratios(&self, predictions: &Predictions) -> Difference {
        let (standard, improved) = (predictions.get(&self.standard), predictions.get(&self.improved));
        Difference {
            miss: ratio(improved.l1.miss_rate, standard.l1.miss_rate),
            miss_pending: ratio(with_pending(improved), with_pending(standard)),
            cycles: ratio(improved.cycles as f64, standard.cycles as f64),
        }
    }

    fn of(&self, predictions: &Predictions) -> Row {
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

fn cluster_jobs(request: &Request) -> impl Iterator<Item = (&'static str, Job)> {
    let size = request.size;
    RAYS.into_iter().zip(scenes::batches(request.secondary)).flat_map(move |(rays, batch)| {
        let job = move |sms| Job { subject: published::CONFERENCE, batch, size, migrate: None, sms: Some(sms) };
        (1..=CLUSTERS).map(move |sms| (rays, job(sms)))
    })
}

fn cluster(rays: &'static str, job: &Job, prediction: &Prediction) -> Cluster {
    Cluster {
        sms: job.sms.unwrap_or_default(),
        rays,
        mrays_per_s: prediction.mrays_per_s,
        latency: prediction.latency.memory,
        l1_miss: prediction.l1.miss_rate,
        l2_miss: prediction.l2.miss_rate,
    }
}

fn scene_row(subject: &Subject) -> SceneRow {
    let statistics = &subject.statistics;
    SceneRow {
        paper: subject.paper,
        source: subject.source.clone(),
        stand_in: subject.stand_in.clone(),
        vertices: subject.vertices,
        triangles: statistics.triangles,
        nodes: statistics.nodes,
        leaves: statistics.leaves,
        bytes: statistics.node_bytes + statistics.triangle_bytes,
    }
}
