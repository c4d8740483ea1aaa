//! Speed against accuracy: models, pictures, traversal, and how cost grows with work.

mod charts;
mod fit;
mod image;
mod model;
mod page;
mod points;
mod subject;
mod traversal;
mod work;

use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::Serialize;

pub use charts::charts;
pub use page::{COLUMNS, page, text};
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
    /// Seconds that it took.
    pub seconds: f64,
}

/// Counts what is done.
struct Steps<'a> {
    done: Cell<usize>,
    total: usize,
    report: &'a dyn Fn(usize, usize),
}

impl Steps<'_> {
    fn done(&self) {
        self.done.set(self.done.get() + 1);
        (self.report)(self.done.get(), self.total);
    }
}

/// Measures everything; `progress` hears of steps done and of steps in all. Nothing runs beside what is timed.
///
/// # Errors
/// [`crate::Error::Usage`] for scenes that no ray meets and for unknown machines, [`crate::Error::Device`] if the
/// device fails, [`crate::Error::Check`] if methods that must agree do not.
pub fn measure(
    request: &Request,
    gpu: Option<&Gpu>,
    subjects: &[Subject],
    progress: &dyn Fn(usize, usize),
) -> Result<Report> {
    let start = Instant::now();
    let of_scene = model::steps() + image::steps(request) + traversal::steps() + work::steps(request);
    let of_simulator = request.simulator.as_ref().map_or(0, model::simulator_steps);
    let total = subjects.len() * of_scene + of_simulator + work::grow_steps(request);
    let steps = Steps { done: Cell::new(0), total, report: progress };
    let mut points = Vec::new();
    for subject in subjects {
        points.extend(model::measure(request, subject, &steps)?);
        points.extend(image::measure(request, gpu, subject, &steps)?);
        points.extend(traversal::measure(request, gpu, subject, &steps)?);
        points.extend(work::measure(request, subject, &steps)?);
    }
    if let Some(simulator) = &request.simulator {
        points.extend(model::beside_simulator(simulator, &steps)?);
    }
    points.extend(work::grow(request, &steps)?);
    points::mark_fronts(&mut points);
    Ok(Report {
        schema: SCHEMA,
        machine: Machine::new(gpu),
        model: request.machine.clone(),
        width: request.size.0,
        height: request.size.1,
        exponents: work::growths(&points),
        points,
        seconds: start.elapsed().as_secs_f64(),
    })
}
