//! How exactly a machine is modelled: error of cycles and of misses over CPU time.

use cpu_time::ProcessTime;

use super::points::{Point, Quantity, Topic, error_interval, relative_error};
use super::{KERNEL, KINDS, Request, Simulator, Steps, Subject};
use crate::fermi::result::Fidelity;
use crate::fermi::sampled;
use crate::render::rays::RayKind;
use crate::report::experiment::{Model, Recording, Traceable};
use crate::report::reference;
use crate::trace::{Ray, Strategy};
use crate::{Error, Result};

/// Ways to predict, the reference last.
const METHODS: [Fidelity; 3] = [Fidelity::Counters, Fidelity::Caches, Fidelity::Cycles];

/// Tolerances for which a sample is taken.
const TOLERANCES: [f64; 3] = [0.2, 0.1, 0.05];
/// Of the draws of samples.
const SEED: u64 = 1;

/// A predicted number, and its 95 % interval where it was sampled.
#[derive(Clone, Copy, Debug)]
struct Estimate {
    value: f64,
    interval: Option<[f64; 2]>,
}

/// What a way to predict says, and the CPU seconds that it took.
struct Outcome {
    method: String,
    seconds: f64,
    cycles: Estimate,
    l1_miss_rate: Estimate,
}

/// Things done by [`measure`] for one scene.
pub fn steps() -> usize {
    KINDS.len() * (METHODS.len() + TOLERANCES.len())
}

/// Cycles and miss rates of a scene, each way.
///
/// # Errors
/// Of rays that are not there, and of machines.
pub fn measure(request: &Request, subject: &Subject, steps: &Steps) -> Result<Vec<Point>> {
    let mut points = Vec::new();
    for kind in KINDS {
        let rays = subject.rays(request.size, kind)?;
        let (recording, recorded_in) = subject.record(&rays, kind);
        let mut outcomes = Vec::new();
        for tolerance in TOLERANCES {
            outcomes.push(sample(&request.machine, subject, (&rays, kind), tolerance)?);
            steps.done();
        }
        for fidelity in METHODS {
            let mut outcome = predict(&request.machine, &recording, fidelity)?;
            outcome.seconds += recorded_in;
            outcomes.push(outcome);
            steps.done();
        }
        points.extend(beside_the_last(&outcomes, &subject.name, kind));
    }
    Ok(points)
}

fn predict(machine: &str, recording: &Recording, fidelity: Fidelity) -> Result<Outcome> {
    let model = Model::new(machine, KERNEL, &[], fidelity)?;
    let start = ProcessTime::now();
    let prediction = model.whole(&recording.recorded(), Strategy::Direct)?;
    let exact = |value| Estimate { value, interval: None };
    Ok(Outcome {
        method: name(fidelity),
        seconds: start.elapsed().as_secs_f64(),
        cycles: exact(prediction.cycles as f64),
        l1_miss_rate: exact(prediction.l1.miss_rate),
    })
}

/// A sample traces its own rays.
fn sample(machine: &str, subject: &Subject, (rays, kind): (&[Ray], RayKind), tolerance: f64) -> Result<Outcome> {
    let model = Model::new(machine, KERNEL, &[], Fidelity::Sampled)?;
    let start = ProcessTime::now();
    let children: Vec<[u32; 2]> = subject.bvh.nodes.iter().map(|node| node.child).collect();
    let rays = Traceable { bvh: &subject.bvh, children: &children, rays, query: kind.query() };
    let prediction = model.sampled(&rays, &sampled::Request { tolerance, time_limit: None, seed: SEED })?;
    Ok(Outcome {
        method: format!("{} {tolerance}", name(Fidelity::Sampled)),
        seconds: start.elapsed().as_secs_f64(),
        cycles: Estimate { value: prediction.cycles as f64, interval: prediction.interval },
        l1_miss_rate: Estimate { value: prediction.l1.miss_rate, interval: prediction.l1.interval },
    })
}

fn beside_the_last(outcomes: &[Outcome], scene: &str, kind: RayKind) -> Vec<Point> {
    type Of = fn(&Outcome) -> Estimate;
    let Some(last) = outcomes.last() else { return Vec::new() };
    let quantities: [(Quantity, Of); 2] =
        [(Quantity::Cycles, |o| o.cycles), (Quantity::L1MissRate, |o| o.l1_miss_rate)];
    let all = quantities.into_iter().flat_map(|(quantity, of)| {
        let reference = of(last).value;
        outcomes.iter().map(move |outcome| {
            let Estimate { value, interval } = of(outcome);
            let row = Row { quantity, scene, rays: kind.name(), method: outcome.method.clone() };
            row.point(outcome.seconds, (value, interval), reference)
        })
    });
    all.collect()
}

/// What a point is of.
struct Row<'a> {
    quantity: Quantity,
    scene: &'a str,
    rays: &'static str,
    method: String,
}

impl Row<'_> {
    fn point(self, seconds: f64, (value, interval): (f64, Option<[f64; 2]>), reference: f64) -> Point {
        let error = relative_error(value, reference);
        let place = crate::report::chart::Point {
            x: seconds,
            y: error,
            interval: interval.map(|interval| error_interval(interval, reference)),
        };
        Point {
            chart: Topic::Model,
            quantity: self.quantity,
            scene: self.scene.to_owned(),
            rays: self.rays,
            method: self.method,
            parameter: None,
            seconds,
            value,
            reference: Some(reference),
            error: Some(error),
            interval,
            on_front: false,
            place,
        }
    }
}

/// Things done by [`beside_simulator`].
pub fn simulator_steps(simulator: &Simulator) -> usize {
    simulator.runs.len() * METHODS.len()
}

/// The same beside the runs of a simulator, and the simulator itself. CPU time holds all from reading the files on.
///
/// # Errors
/// As of [`reference::compare`].
pub fn beside_simulator(simulator: &Simulator, steps: &Steps) -> Result<Vec<Point>> {
    let mut points = Vec::new();
    for run in &simulator.runs {
        let rays = batch(&run.batch);
        let scene = format!("{} {}", run.simulator, run.case);
        let quantities = [Quantity::SimulatorCycles, Quantity::SimulatorL1MissRate];
        let row = |quantity, method| Row { quantity, scene: &scene, rays, method };
        for fidelity in METHODS {
            let start = ProcessTime::now();
            let rows = reference::compare(std::slice::from_ref(run), &simulator.cases, fidelity, &[])?;
            let seconds = start.elapsed().as_secs_f64();
            let prediction = rows.first().map(|row| &row.prediction);
            let prediction = prediction.ok_or_else(|| Error::Check(format!("{scene}: no prediction")))?;
            let values = [prediction.cycles as f64, prediction.l1.miss_rate];
            for (k, reference) in [run.cycles as f64, run.l1_miss_rate].into_iter().enumerate() {
                points.push(row(quantities[k], name(fidelity)).point(seconds, (values[k], None), reference));
            }
            steps.done();
        }
        if let Some(seconds) = run.simulator_cpu_s {
            for (k, value) in [run.cycles as f64, run.l1_miss_rate].into_iter().enumerate() {
                points.push(row(quantities[k], "GPGPU-Sim".to_owned()).point(seconds, (value, None), value));
            }
        }
    }
    Ok(points)
}

/// Kind of the rays of a batch of the reference runs.
fn batch(name: &str) -> &'static str {
    match name {
        "prim" => RayKind::Primary.name(),
        "diff" => RayKind::Diffuse.name(),
        "refl" => RayKind::Reflect.name(),
        _ => "other",
    }
}

fn name(fidelity: Fidelity) -> String {
    crate::report::model::name(&fidelity)
}
