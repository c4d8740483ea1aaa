//! Fidelity `sampled`: the replay of `caches` for some stretches of a launch, with an interval for the whole.
//!
//! Blocks that run at the same time share caches and issue, so what is drawn is a *stretch* of consecutive blocks, and
//! stretches, not warps or rays, are what the interval counts as independent. A rough number of visits, from a few
//! rays of each warp, tells which stretches are dear; they are drawn in proportion to it and stand for the others by
//! the ratio to it (`design`). The drawn stretches are replayed as one short launch, each after blocks that warm caches
//! and fill multiprocessors (`stretch`). How long a launch takes is more than a sum, because its end waits for the
//! longest block; so all blocks, with drawn ratios where they were not measured, go through the block scheduler
//! (`schedule`). Repeating that with other draws gives the interval (`estimate`).

mod design;
mod estimate;
mod schedule;
mod stretch;

#[cfg(test)]
mod tests;

use std::ops::Range;
use std::time::Instant;

use serde::Serialize;

use self::design::Design;
use self::estimate::Estimates;
use self::stretch::Sample;
use super::caches;
use super::kernel::Kernel;
use super::launch::{Launch, Stage, Work, Workload};
use super::machine::Machine;
use super::result::{Accounting, Fidelity, Prediction};
use super::times::Times;
use crate::Result;
use crate::trace::StepTrace;

/// Draws of the first rung of the ladder: fewer make Student's t too wide to be of use.
const FIRST_DRAWS: usize = 8;

/// Passes of a full replay: one without queues, one with those that it finds.
const FULL_PASSES: usize = 2;

/// Where rays come from. Tracing is part of the cost, so it is asked for piece by piece.
pub trait Source {
    /// Rays in all.
    fn rays(&self) -> usize;
    /// Nodes and leaves that a ray visits, without recording them.
    fn visits(&self, ray: usize) -> u32;
    /// Steps of rays that follow each other.
    fn record(&self, rays: Range<usize>) -> StepTrace;
    /// Child links of each node of the tree.
    fn children(&self) -> &[[u32; 2]];
    /// Triangles of the tree.
    fn triangles(&self) -> usize;
}

/// What is asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request {
    /// Half the interval over the estimate, of cycles and of the L1's miss rate, that is good enough.
    pub tolerance: f64,
    /// Seconds after which the best answer so far is given.
    pub time_limit: Option<f64>,
    /// Of the draws.
    pub seed: u64,
}

/// Something left out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Skipped {
    /// What.
    pub what: &'static str,
    /// Why.
    pub why: String,
}

/// What was done for it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Effort {
    /// The tolerance asked for.
    pub asked: f64,
    /// The tolerance reached; 0 for the full replay.
    pub reached: f64,
    /// Whether that is enough.
    pub met: bool,
    /// Interval of cycles.
    pub interval: [f64; 2],
    /// Warps replayed, those that only warm caches among them.
    pub sampled_warps: usize,
    /// Warps of the launch.
    pub warps: usize,
    /// What was left out.
    pub skipped: Vec<Skipped>,
    /// Seconds in which rays were traced and recorded.
    pub seconds_recording: f64,
    /// Seconds in which they were replayed and the whole was estimated.
    pub seconds_model: f64,
    /// Time of the full replay over that spent, estimated from the work left out.
    pub saving_estimated: f64,
}

/// Seconds spent.
#[derive(Clone, Copy, Debug, Default)]
struct Spent {
    recording: f64,
    model: f64,
}

fn timed<T>(seconds: &mut f64, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    *seconds += start.elapsed().as_secs_f64();
    result
}

/// Predicts a launch of `kernel` with a thread a ray, by no more stretches than the tolerance needs.
///
/// # Errors
/// [`crate::Error::Usage`] if no block fits a multiprocessor.
pub fn predict(
    machine: &Machine,
    kernel: &Kernel,
    source: &(impl Source + Sync),
    request: &Request,
) -> Result<Prediction> {
    let mut spent = Spent::default();
    let design = timed(&mut spent.recording, || Design::new(machine, kernel, source, request.seed))?;
    let mut sample = Sample::default();
    let mut draws = FIRST_DRAWS;
    while design.worthwhile(draws) {
        sample.extend(machine, kernel, source, (&design, draws), &mut spent)?;
        let estimates = timed(&mut spent.model, || Estimates::new(&design, &sample, draws, request.seed));
        let reached = estimates.relative_error();
        // The interval shrinks with the root of the draws (Cochran 1977, section 4.4): if more would be needed than
        // are worthwhile, the full replay comes next.
        let enough = draws as f64 * (reached / request.tolerance).powi(2);
        let next = if enough <= design.most_draws() as f64 { 2 * draws } else { usize::MAX };
        let per_block = (spent.recording + spent.model) / sample.replayed as f64;
        let blocks = if design.worthwhile(next) { sample.replayed } else { FULL_PASSES * design.blocks() };
        let seconds = spent.recording + spent.model + per_block * blocks as f64;
        if reached <= request.tolerance || request.time_limit.is_some_and(|limit| seconds > limit) {
            return answer(machine, kernel, source, request, (&design, &sample, &estimates), spent);
        }
        draws = next;
    }
    full(machine, kernel, source, request, spent)
}

/// The answer of a sample.
fn answer(
    machine: &Machine,
    kernel: &Kernel,
    source: &impl Source,
    request: &Request,
    (design, sample, estimates): (&Design, &Sample, &Estimates),
    spent: Spent,
) -> Result<Prediction> {
    // All rays, for their number; their steps are in the estimates.
    let rays = StepTrace { starts: vec![0; source.rays() + 1], steps: Vec::new() };
    let launches = [launch(kernel, workload(source, &rays))];
    let times = sample.times.unwrap_or_else(|| Times::unloaded(machine));
    let parts = [caches::part(machine, &launches[0], times, &estimates.outcome)?];
    let prediction = Prediction::of(machine, &launches, &parts, (Fidelity::Sampled, Accounting::Full));
    let reached = estimates.relative_error();
    let share = 100.0 * sample.recorded as f64 / design.blocks() as f64;
    let why = format!("{share:.1} % of the blocks tell enough");
    let effort = Effort {
        asked: request.tolerance,
        reached,
        met: reached <= request.tolerance,
        interval: estimates.cycles.interval,
        sampled_warps: sample.warps(kernel),
        warps: source.rays().div_ceil(super::simt::LANES),
        skipped: vec![Skipped { what: "replay of the other blocks", why }],
        seconds_recording: spent.recording,
        seconds_model: spent.model,
        saving_estimated: (FULL_PASSES * design.blocks()) as f64 / sample.replayed as f64,
    };
    Ok(prediction.sampled([estimates.cycles, estimates.l1, estimates.l2].map(|e| e.interval), effort))
}

/// The full replay, whose interval is a point.
fn full(
    machine: &Machine,
    kernel: &Kernel,
    source: &impl Source,
    request: &Request,
    mut spent: Spent,
) -> Result<Prediction> {
    let trace = timed(&mut spent.recording, || source.record(0..source.rays()));
    let launches = [launch(kernel, workload(source, &trace))];
    let before = spent.recording + spent.model;
    let parts = timed(&mut spent.model, || caches::replay(machine, &launches))?;
    let prediction = Prediction::of(machine, &launches, &parts, (Fidelity::Sampled, Accounting::Full));
    let [cycles, l1, l2] = [prediction.cycles as f64, prediction.l1.miss_rate, prediction.l2.miss_rate];
    let warps = source.rays().div_ceil(super::simt::LANES);
    let all = spent.recording + spent.model;
    let effort = Effort {
        asked: request.tolerance,
        reached: 0.0,
        met: true,
        interval: [cycles; 2],
        sampled_warps: warps,
        warps,
        skipped: Vec::new(),
        seconds_recording: spent.recording,
        seconds_model: spent.model,
        saving_estimated: (all - before) / all,
    };
    Ok(prediction.sampled([cycles, l1, l2].map(|value| [value; 2]), effort))
}

fn workload<'a>(source: &'a impl Source, trace: &'a StepTrace) -> Workload<'a> {
    Workload { trace, children: source.children(), triangles: source.triangles(), cut: None }
}

fn launch<'a>(kernel: &'a Kernel, workload: Workload<'a>) -> Launch<'a> {
    Launch { kernel, workload, work: Work::Rays, virtual_caches: false, stage: Stage::Traverse }
}
