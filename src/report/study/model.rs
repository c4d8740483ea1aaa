//! How exactly a machine is modelled: error of cycles and of misses over CPU time.

use cpu_time::ProcessTime;

use super::points::{Measured, Point, Quantity, Row, Topic, error_interval, relative_error};
use super::{KERNEL, KINDS, Request, Simulator, Subject};
use crate::fermi::result::Fidelity;
use crate::fermi::sampled;
use crate::render::rays::RayKind;
use crate::report::chart;
use crate::report::experiment::{Model, Recording, Traceable, Traversal};
use crate::report::reference;
use crate::trace::{Ray, Strategy};
use crate::{Error, Result};

/// Ways to predict, the reference last.
const METHODS: [Fidelity; 3] = [Fidelity::Counters, Fidelity::Caches, Fidelity::Cycles];

/// Tolerances for which a sample is taken, beside the one asked for.
const TOLERANCES: [f64; 3] = [0.2, 0.1, 0.05];
/// Of the draws of samples.
const SEED: u64 = 1;

/// What a way to predict says, and the CPU seconds that it took.
pub struct Outcome {
    /// The way.
    pub method: String,
    /// CPU seconds.
    pub seconds: f64,
    /// Core cycles.
    pub cycles: Measured,
    /// Misses an access.
    pub l1_miss_rate: Measured,
}

/// Cycles and miss rates of a scene, each way.
///
/// # Errors
/// Of rays that are not there, and of machines.
pub fn measure(request: &Request, subject: &Subject) -> Result<Vec<Point>> {
    let mut tolerances: Vec<f64> = TOLERANCES.into_iter().chain(request.tolerance).collect();
    tolerances.sort_by(|a, b| b.total_cmp(a));
    tolerances.dedup();
    let model = |fidelity| Model::new(&request.machine, KERNEL, &[], fidelity);
    let mut points = Vec::new();
    for kind in KINDS {
        let rays = subject.rays(request.size, kind)?;
        let (recording, recorded_in) = subject.record(&rays, kind);
        let mut outcomes = Vec::new();
        for &tolerance in &tolerances {
            outcomes.push(sample(&model(Fidelity::Sampled)?, subject, (&rays, kind), tolerance)?);
        }
        for fidelity in METHODS {
            outcomes.push(predict(&model(fidelity)?, &recording, recorded_in)?);
        }
        points.extend(beside_the_last(&outcomes, &subject.name, kind));
    }
    Ok(points)
}

/// The whole launch, of rays that were recorded in `recorded_in` CPU seconds.
///
/// # Errors
/// As of [`Model::whole`].
pub fn predict(model: &Model, recording: &Recording, recorded_in: f64) -> Result<Outcome> {
    let start = ProcessTime::now();
    let prediction = model.whole(&recording.recorded(), Strategy::Direct)?;
    Ok(Outcome {
        method: name(model.fidelity),
        seconds: recorded_in + start.elapsed().as_secs_f64(),
        cycles: (prediction.cycles as f64, None),
        l1_miss_rate: (prediction.l1.miss_rate, None),
    })
}

/// A sample, which traces its own rays.
///
/// # Errors
/// As of [`Model::sampled`].
pub fn sample(model: &Model, subject: &Subject, (rays, kind): (&[Ray], RayKind), tolerance: f64) -> Result<Outcome> {
    let start = ProcessTime::now();
    let children: Vec<[u32; 2]> = subject.bvh.nodes.iter().map(|node| node.child).collect();
    let rays = Traceable { traversal: Traversal::Scene(&subject.bvh, kind.query()), children: &children, rays };
    let prediction = model.sampled(&rays, &sampled::Request { tolerance, time_limit: None, seed: SEED })?;
    Ok(Outcome {
        method: format!("{} {tolerance}", name(Fidelity::Sampled)),
        seconds: start.elapsed().as_secs_f64(),
        cycles: (prediction.cycles as f64, prediction.interval),
        l1_miss_rate: (prediction.l1.miss_rate, prediction.l1.interval),
    })
}

/// Points of all outcomes, with the values of the last as the reference.
fn beside_the_last(outcomes: &[Outcome], scene: &str, kind: RayKind) -> Vec<Point> {
    type Of = fn(&Outcome) -> Measured;
    let Some(last) = outcomes.last() else { return Vec::new() };
    let quantities: [(Quantity, Of); 2] =
        [(Quantity::Cycles, |o| o.cycles), (Quantity::L1MissRate, |o| o.l1_miss_rate)];
    let all = quantities.into_iter().flat_map(|(quantity, of)| {
        let (reference, _) = of(last);
        outcomes.iter().map(move |outcome| {
            judged(&row(scene, kind.name(), &outcome.method), quantity, outcome.seconds, of(outcome), reference)
        })
    });
    all.collect()
}

fn row<'a>(scene: &'a str, rays: &'static str, method: &str) -> Row<'a> {
    Row { chart: Topic::Model, scene, rays, method: method.to_owned(), parameter: None }
}

/// A point with its error.
fn judged(row: &Row, quantity: Quantity, seconds: f64, measured: Measured, reference: f64) -> Point {
    let error = relative_error(measured.0, reference);
    let interval = measured.1.map(|interval| error_interval(interval, reference));
    let place = chart::Point { x: seconds, y: error, interval };
    Point { reference: Some(reference), error: Some(error), ..row.point(quantity, seconds, measured, place) }
}

/// The same beside the runs of a simulator, and the simulator itself. CPU time holds all from reading the files on.
///
/// # Errors
/// As of [`reference::compare`].
pub fn beside_simulator(simulator: &Simulator) -> Result<Vec<Point>> {
    const QUANTITIES: [Quantity; 2] = [Quantity::SimulatorCycles, Quantity::SimulatorL1MissRate];
    let mut points = Vec::new();
    for run in &simulator.runs {
        let scene = format!("{} {}", run.simulator, run.case);
        let references = [run.cycles as f64, run.l1_miss_rate];
        let mut add = |method: &str, seconds: f64, values: [f64; 2]| {
            let row = row(&scene, batch(&run.batch), method);
            for ((quantity, value), reference) in QUANTITIES.into_iter().zip(values).zip(references) {
                points.push(judged(&row, quantity, seconds, (value, None), reference));
            }
        };
        for fidelity in METHODS {
            let start = ProcessTime::now();
            let rows = reference::compare(std::slice::from_ref(run), &simulator.cases, fidelity, &[])?;
            let prediction = rows.first().map(|row| &row.prediction);
            let prediction = prediction.ok_or_else(|| Error::Check(format!("{scene}: no prediction")))?;
            let values = [prediction.cycles as f64, prediction.l1.miss_rate];
            add(&name(fidelity), start.elapsed().as_secs_f64(), values);
        }
        if let Some(seconds) = run.simulator_cpu_s {
            add("GPGPU-Sim", seconds, references);
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
