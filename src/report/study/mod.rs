//! Speed against accuracy: models, pictures, traversal, and how cost grows with work.

mod charts;
mod fit;
mod image;
mod model;
mod page;
mod plan;
mod points;
mod subject;
mod traversal;
mod work;

use std::path::{Path, PathBuf};

use serde::Serialize;

pub use charts::charts;
pub use page::{COLUMNS, page, text};
pub use plan::{LeftOut, Part, Progress};
pub use points::{Point, Quantity, TOPICS, Topic};
pub use subject::Subject;
pub use work::Growth;

use super::experiment::Model;
use super::machine::Machine;
use super::reference::{self, Run};
use crate::Result;
use crate::fermi::result::Fidelity;
use crate::render::rays::RayKind;
use crate::vulkan::Gpu;
use plan::Plan;

/// Version of the JSON.
pub const SCHEMA: &str = "caribou-study/1";

/// Kernel of the models: that of the simulator's runs.
const KERNEL: &str = "while-while";

/// Rays of models and of traversal: those that run side by side, and those that scatter.
const KINDS: [RayKind; 2] = [RayKind::Primary, RayKind::Diffuse];

/// Runs of a simulator to compare models with.
pub struct Simulator {
    runs: Vec<Run>,
    cases: PathBuf,
}

impl Simulator {
    /// Reads a reference file and checks that the folder `cases` has what its runs traced.
    ///
    /// # Errors
    /// [`crate::Error::Io`] or [`crate::Error::Input`].
    pub fn read(file: &Path, cases: &Path) -> Result<Simulator> {
        let runs = reference::read_runs(file)?;
        reference::check_runs(&runs, file, cases)?;
        Ok(Simulator { runs, cases: cases.to_owned() })
    }
}

/// What is asked for.
pub struct Request {
    /// Pixels across and down.
    pub size: (u32, u32),
    /// Machine of the models.
    pub machine: String,
    /// Runs of a simulator.
    pub simulator: Option<Simulator>,
    /// Few samples and small scenes, to see that all works.
    pub quick: bool,
    /// Scenes of up to ten million triangles.
    pub full: bool,
    /// Seconds within which the dearest measurements are left out.
    pub time_limit: Option<f64>,
    /// Where cycles only show how cost grows, predict them from samples that are this exact.
    pub tolerance: Option<f64>,
}

impl Request {
    /// Refuses unknown machines.
    ///
    /// # Errors
    /// [`crate::Error::Usage`].
    pub fn check(&self) -> Result<()> {
        Model::new(&self.machine, KERNEL, &[], Fidelity::Cycles).map(drop)
    }
}

/// All of it: schema `caribou-study/1`.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// [`SCHEMA`].
    pub schema: &'static str,
    /// Where pictures and traversal were timed.
    pub machine: Machine,
    /// Machine of the models.
    pub model: String,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// All measured values.
    pub points: Vec<Point>,
    /// Power laws of the points of [`Topic::Work`].
    pub exponents: Vec<Growth>,
    /// The tolerance asked for.
    pub tolerance: Option<f64>,
    /// How long each part took.
    pub parts: Vec<Part>,
    /// What there was no time for.
    pub left_out: Vec<LeftOut>,
    /// Seconds that it took.
    pub seconds: f64,
}

/// Shares of the time limit: of the parts of each scene, of the runs of a simulator, and of procedural scenes, whose last
/// are the dearest measurements of all.
const SCENE_WEIGHTS: [f64; 4] = [2.0, 3.0, 1.0, 2.0];
const SIMULATOR_WEIGHT: f64 = 2.0;
const GROWTH_WEIGHT: f64 = 6.0;

/// Measures everything; `progress` hears of each part. Nothing runs beside what is timed.
///
/// # Errors
/// [`crate::Error::Usage`] for scenes that no ray meets and for unknown machines, [`crate::Error::Device`] if the
/// device fails, [`crate::Error::Check`] if methods that must agree do not.
pub fn measure(
    request: &Request,
    gpu: Option<&Gpu>,
    subjects: &[Subject],
    progress: &dyn Fn(Progress),
) -> Result<Report> {
    let mut weights = SCENE_WEIGHTS.repeat(subjects.len());
    weights.extend(request.simulator.iter().map(|_| SIMULATOR_WEIGHT));
    weights.push(GROWTH_WEIGHT);
    let mut plan = Plan::new(weights, request.time_limit, progress);
    let mut points = Vec::new();
    for subject in subjects {
        let of = |topic: Topic| format!("{} of {}", topic.name(), subject.name);
        points.extend(plan.part(of(Topic::Model), |_| model::measure(request, subject))?);
        points.extend(plan.part(of(Topic::Image), |plan| image::measure(request, gpu, subject, plan))?);
        points.extend(plan.part(of(Topic::Traversal), |_| traversal::measure(request, gpu, subject))?);
        points.extend(plan.part(of(Topic::Work), |plan| work::measure(request, subject, plan))?);
    }
    if let Some(simulator) = &request.simulator {
        points.extend(plan.part("model beside a simulator".to_owned(), |_| model::beside_simulator(simulator))?);
    }
    points.extend(plan.part("work of procedural scenes".to_owned(), |plan| work::grow(request, plan))?);
    points::mark_fronts(&mut points);
    Ok(Report {
        schema: SCHEMA,
        machine: Machine::new(gpu),
        model: request.machine.clone(),
        width: request.size.0,
        height: request.size.1,
        exponents: work::growths(&points),
        points,
        tolerance: request.tolerance,
        seconds: plan.elapsed(),
        parts: plan.finished,
        left_out: plan.left_out,
    })
}
