//! Fidelity `sampled`: the replay of `caches` for some multiprocessors of a machine, with an interval for the whole.
//!
//! All rays are recorded, and what each block of threads costs alone follows from their steps at a small part of a
//! replay's cost (`work`). What caches and company add to it is a factor that differs little from place to place. The
//! block scheduler gives each multiprocessor blocks from all over the launch, so one of them is a sample of it
//! (`design`), and the blocks that it holds at a time are near each other as they are in the whole, so that its L1 does
//! what it does there. What it shares with the others is the L2. So it is replayed with an even share of the L2, and the
//! first one also with the tree in it; the truth lies between, where the L2 misses as often as in glimpses of the whole
//! machine (`sample`). Cycles of the blocks that were not replayed are regressed on their cost alone and their steps
//! (`estimate`). How long a launch takes is more than a sum, because its end waits for the longest block: so all blocks go
//! through the block scheduler (`schedule`), several times, those not replayed as they might be (`ending`).

mod design;
mod ending;
mod estimate;
mod sample;
mod schedule;
mod work;

#[cfg(test)]
mod tests;

use std::time::Instant;

use serde::Serialize;

use self::design::Design;
use self::estimate::{Estimates, Parts};
use self::sample::{GLIMPSES, Sample};
use super::caches;
use super::launch::Launch;
use super::machine::Machine;
use super::occupancy::launchable;
use super::result::{Accounting, Fidelity, Prediction};
use super::times::Times;
use crate::Result;

/// What is asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request {
    /// Half the interval of cycles over their estimate that is good enough. Miss rates have intervals of their own.
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
    /// Warps replayed.
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
    /// On what blocks cost alone, and on estimates.
    estimate: f64,
    replay: f64,
}

impl Spent {
    fn total(&self) -> f64 {
        self.recording + self.estimate + self.replay
    }
}

fn timed<T>(seconds: &mut f64, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    *seconds += start.elapsed().as_secs_f64();
    result
}

/// Predicts a launch with a thread a ray, by no more multiprocessors than the tolerance needs. Its rays were traced and
/// recorded in `recording` seconds.
///
/// # Errors
/// [`crate::Error::Usage`] if no block fits a multiprocessor.
pub fn predict(machine: &Machine, launch: &Launch, recording: f64, request: &Request) -> Result<Prediction> {
    let mut spent = Spent { recording, ..Spent::default() };
    let slots = launch.slots(launchable(machine, launch)?.blocks);
    let work = timed(&mut spent.estimate, || work::of(machine, launch));
    let design = Design::new(work, (machine.sms as usize, slots), request.seed);
    let mut sample = Sample::default();
    let (mut sms, mut glimpses) = (design.first_sms(), GLIMPSES);
    while sms <= design.most_sms() {
        timed(&mut spent.replay, || sample.extend(machine, launch, &design, sms))?;
        let in_time = |seconds: f64| request.time_limit.is_none_or(|limit| seconds <= limit);
        if !sample.worth_looking(machine, glimpses) && in_time(spent.total() + sample.full(machine)) {
            break;
        }
        timed(&mut spent.replay, || sample.look(machine, launch, &design, glimpses))?;
        let estimates = timed(&mut spent.estimate, || Estimates::new(&design, &sample));
        let Some(estimates) = estimates else { break };
        let reached = estimates.cycles.relative_error();
        let next = enough(&design, (sms, glimpses), estimates.parts, request.tolerance);
        let more = if next.0 <= design.most_sms() {
            spent.replay * ((next.0 as f64 / sms as f64).max(next.1 as f64 / glimpses as f64) - 1.0)
        } else {
            sample.full(machine)
        };
        if reached <= request.tolerance || !in_time(spent.total() + more) {
            return answer(machine, launch, request, (&design, &sample, &estimates), spent);
        }
        (sms, glimpses) = next;
    }
    full(machine, launch, request, spent)
}

/// Multiprocessors and glimpses that would be enough if more of them shrink their `parts` of the error with the root of
/// their number (Cochran 1977, section 4.4): more of what the error comes from, at least of one of them.
fn enough(design: &Design, have: (usize, usize), parts: Parts, tolerance: f64) -> (usize, usize) {
    let (mut sms, mut glimpses) = have;
    let left = |sms: usize, glimpses: usize| {
        [parts.blocks * (have.0 as f64 / sms as f64).sqrt(), parts.l2 * (have.1 as f64 / glimpses as f64).sqrt()]
    };
    loop {
        let [by_blocks, by_l2] = left(sms, glimpses);
        if by_l2 > by_blocks {
            glimpses += GLIMPSES
        } else {
            sms += 1
        }
        let [by_blocks, by_l2] = left(sms, glimpses);
        if sms > design.most_sms() || by_blocks.hypot(by_l2).hypot(parts.end) <= tolerance {
            return (sms, glimpses);
        }
    }
}

/// The answer of a sample.
fn answer(
    machine: &Machine,
    launch: &Launch,
    request: &Request,
    (design, sample, estimates): (&Design, &Sample, &Estimates),
    spent: Spent,
) -> Result<Prediction> {
    let times = sample.times.unwrap_or_else(|| Times::unloaded(machine));
    let launches = [*launch];
    let parts = [caches::part(machine, launch, times, &estimates.outcome)?];
    let prediction = Prediction::of(machine, &launches, &parts, (Fidelity::Sampled, Accounting::Full));
    let reached = estimates.cycles.relative_error();
    let why = format!("{} of {} multiprocessors tell enough", sample.runs.len(), design.sms);
    let effort = Effort {
        asked: request.tolerance,
        reached,
        met: reached <= request.tolerance,
        interval: estimates.cycles.interval,
        sampled_warps: sample.runs.iter().flat_map(|run| &run.blocks).map(|&block| launch.warps_of(block)).sum(),
        warps: launch.rays().div_ceil(super::simt::LANES),
        skipped: vec![Skipped { what: "replay of the other multiprocessors", why }],
        seconds_recording: spent.recording,
        seconds_model: spent.estimate + spent.replay,
        saving_estimated: (spent.recording + sample.full(machine)) / spent.total(),
    };
    Ok(prediction.sampled([estimates.cycles, estimates.l1, estimates.l2].map(|e| e.interval), effort))
}

/// The full replay, whose interval is a point.
fn full(machine: &Machine, launch: &Launch, request: &Request, mut spent: Spent) -> Result<Prediction> {
    let launches = [*launch];
    let before = spent.estimate + spent.replay;
    let parts = timed(&mut spent.replay, || caches::replay(machine, &launches))?;
    let prediction = Prediction::of(machine, &launches, &parts, (Fidelity::Sampled, Accounting::Full));
    let [cycles, l1, l2] = [prediction.cycles as f64, prediction.l1.miss_rate, prediction.l2.miss_rate];
    let warps = launch.rays().div_ceil(super::simt::LANES);
    let effort = Effort {
        asked: request.tolerance,
        reached: 0.0,
        met: true,
        interval: [cycles; 2],
        sampled_warps: warps,
        warps,
        skipped: Vec::new(),
        seconds_recording: spent.recording,
        seconds_model: spent.estimate + spent.replay,
        saving_estimated: (spent.total() - before) / spent.total(),
    };
    Ok(prediction.sampled([cycles, l1, l2].map(|value| [value; 2]), effort))
}
