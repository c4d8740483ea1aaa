//! How cost grows with work: triangles, rays and multiprocessors.

use std::time::Instant;

use serde::Serialize;

use super::fit::Exponent;
use super::model::{Outcome, predict, sample};
use super::plan::Plan;
use super::points::{Measured, Parameter, Point, Quantity, REPETITIONS, Row, Topic, repeated};
use super::{KERNEL, Request, Subject};
use crate::Result;
use crate::bvh::statistics::Statistics;
use crate::bvh::{Bvh, Quality};
use crate::fermi::result::Fidelity;
use crate::render::rays::RayKind;
use crate::report::chart;
use crate::report::experiment::{Model, Recording};
use crate::scene::procedural;
use crate::shared::LEAF_BIT;
use crate::trace::Ray;

/// Procedural scenes that grow: a common kind, and the worst for boxes.
const RECIPES: [&str; 2] = ["room", "needles"];

/// Builds of at most so many triangles are repeated, for an interval.
const MOST_REPEATED: usize = 100_000;

/// Multiprocessors up to those of the GeForce GTX 480, and twice as many.
const SMS: [u32; 6] = [1, 2, 4, 8, 15, 30];

/// Rays that are counted.
const KIND: RayKind = RayKind::Primary;

/// Scenes that grow are seen in pictures of this part of the width and height: their rays visit thousands of nodes.
const GROWN_PART: u32 = 4;

/// How a quantity grows with a parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Growth {
    /// The scene or recipe.
    pub scene: String,
    /// What grows.
    pub quantity: Quantity,
    /// With what.
    pub parameter: &'static str,
    /// The power law.
    #[serde(flatten)]
    pub exponent: Exponent,
}

/// Numbers of triangles: two a decade.
fn triangles(request: &Request) -> Vec<usize> {
    let all = [1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000, 3_000_000, 10_000_000];
    let count = match (request.quick, request.full) {
        (true, _) => 3,
        (false, false) => 7,
        (false, true) => all.len(),
    };
    all[..count].to_vec()
}

/// A part of the width and height of a picture.
fn part((width, height): (u32, u32), part: u32) -> (u32, u32) {
    (width.div_ceil(part), height.div_ceil(part))
}

/// Sizes of pictures: each four times the pixels of the one before.
fn sizes(request: &Request) -> Vec<(u32, u32)> {
    let parts: &[u32] = if request.quick { &[4, 2, 1] } else { &[8, 4, 2, 1] };
    parts.iter().map(|&one| part(request.size, one)).collect()
}

/// Cost over triangles, of procedural scenes.
///
/// # Errors
/// As of building.
pub fn grow(request: &Request, plan: &mut Plan) -> Result<Vec<Point>> {
    let mut points = Vec::new();
    let mut paces = [Pace::default(); RECIPES.len()];
    for count in triangles(request) {
        for (recipe, pace) in RECIPES.into_iter().zip(&mut paces) {
            let parameter = Parameter { name: "triangles", value: count as f64 };
            let scene = procedural::build(recipe, count, 1)?;
            let mut seconds = Vec::new();
            let mut build = || {
                let start = Instant::now();
                let bvh = Bvh::build(&scene.positions, Quality::default());
                seconds.push(start.elapsed().as_secs_f64());
                bvh
            };
            let mut bvh = build()?;
            for _ in 1..if count <= MOST_REPEATED { REPETITIONS } else { 1 } {
                bvh = build()?;
            }
            let statistics = Statistics::of(&bvh);
            let bytes = (statistics.node_bytes + statistics.triangle_bytes) as f64;
            if let Some((median, interval)) = repeated(&seconds) {
                let point = |quantity, measured| point(recipe, parameter, "build", quantity, median, measured);
                points.push(point(Quantity::BuildSeconds, (median, interval)));
                points.push(point(Quantity::MemoryBytes, (bytes, None)));
            }
            let traced = Traced::new(Subject::new(recipe, scene, bvh)?, part(request.size, GROWN_PART))?;
            points.push(traced.visits(parameter));
            points.extend(traced.cycles(request, parameter, pace, plan)?);
        }
    }
    Ok(points)
}

/// Cost of a scene over rays and over multiprocessors.
///
/// # Errors
/// Of rays that are not there, and of machines.
pub fn measure(request: &Request, subject: &Subject, plan: &mut Plan) -> Result<Vec<Point>> {
    let mut points = Vec::new();
    let mut pace = Pace::default();
    let mut largest = None;
    for size in sizes(request) {
        let traced = Traced::new(subject, size)?;
        let parameter = Parameter { name: "rays", value: traced.rays.len() as f64 };
        points.push(traced.visits(parameter));
        points.extend(traced.cycles(request, parameter, &mut pace, plan)?);
        largest = Some(traced);
    }
    for sms in SMS {
        let parameter = Parameter { name: "sms", value: sms.into() };
        if let Some(traced) = &largest {
            points.extend(traced.cycles(request, parameter, &mut pace, plan)?);
        }
    }
    Ok(points)
}

/// Rays and what they did in a scene.
struct Traced<S> {
    subject: S,
    rays: Vec<Ray>,
    recording: Recording,
    /// CPU seconds of recording.
    seconds: f64,
}

impl<S: std::borrow::Borrow<Subject>> Traced<S> {
    fn new(subject: S, size: (u32, u32)) -> Result<Traced<S>> {
        let rays = subject.borrow().rays(size, KIND)?;
        let (recording, seconds) = subject.borrow().record(&rays, KIND);
        Ok(Traced { subject, rays, recording, seconds })
    }

    fn visits(&self, parameter: Parameter) -> Point {
        let trace = &self.recording.trace;
        let nodes = trace.steps.iter().filter(|&step| step & LEAF_BIT == 0).count();
        let visits = (nodes as f64 / trace.rays() as f64, None);
        let scene = &self.subject.borrow().name;
        point(scene, parameter, "recording", Quantity::NodeVisitsPerRay, self.seconds, visits)
    }

    /// Cycles, if there is time for them: all replayed, or within the tolerance that was asked for.
    fn cycles(
        &self,
        request: &Request,
        parameter: Parameter,
        pace: &mut Pace,
        plan: &mut Plan,
    ) -> Result<Option<Point>> {
        let (subject, steps) = (self.subject.borrow(), self.recording.trace.steps.len() as f64);
        let expected = pace.seconds_a_step * steps;
        if !plan.affords(expected) {
            plan.leave_out(format!("{}: cycles at {} {}", subject.name, parameter.value, parameter.name), expected);
            return Ok(None);
        }
        let start = Instant::now();
        let settings = if parameter.name == "sms" { vec![format!("sms={}", parameter.value)] } else { Vec::new() };
        let model = |fidelity| Model::new(&request.machine, KERNEL, &settings, fidelity);
        let Outcome { method, seconds, cycles, .. } = match request.tolerance {
            None => predict(&model(Fidelity::Cycles)?, &self.recording, self.seconds)?,
            Some(tolerance) => sample(&model(Fidelity::Sampled)?, subject, (&self.rays, KIND), tolerance)?,
        };
        pace.seconds_a_step = start.elapsed().as_secs_f64() / steps.max(1.0);
        Ok(Some(point(&subject.name, parameter, &method, Quantity::Cycles, seconds, cycles)))
    }
}

/// How fast predictions are: nothing is known before the first, which is the cheapest.
#[derive(Clone, Copy, Default)]
struct Pace {
    seconds_a_step: f64,
}

fn point(
    scene: &str,
    parameter: Parameter,
    method: &str,
    quantity: Quantity,
    seconds: f64,
    (value, interval): Measured,
) -> Point {
    let row =
        Row { chart: Topic::Work, scene, rays: KIND.name(), method: method.to_owned(), parameter: Some(parameter) };
    row.point(quantity, seconds, (value, interval), chart::Point { x: parameter.value, y: value, interval })
}

/// Values of a quantity over a parameter.
struct Series<'a> {
    first: &'a Point,
    parameter: &'static str,
    values: Vec<(f64, f64)>,
}

/// Power laws of all points of [`Topic::Work`]: one a scene, quantity and parameter, in the order of their first
/// points.
pub fn growths(points: &[Point]) -> Vec<Growth> {
    let mut all: Vec<Series> = Vec::new();
    for point in points.iter().filter(|point| point.chart == Topic::Work) {
        let Some(Parameter { name, value }) = point.parameter else { continue };
        let key = (&point.scene, point.quantity, name);
        let at = all.iter().position(|s| (&s.first.scene, s.first.quantity, s.parameter) == key);
        let at = at.unwrap_or_else(|| {
            all.push(Series { first: point, parameter: name, values: Vec::new() });
            all.len() - 1
        });
        all[at].values.push((value, point.value));
    }
    let growth = |Series { first, parameter, values }: Series| {
        let exponent = Exponent::of(&values)?;
        Some(Growth { scene: first.scene.clone(), quantity: first.quantity, parameter, exponent })
    };
    all.into_iter().filter_map(growth).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::study::points::tests::point;

    #[test]
    fn each_scene_quantity_and_parameter_has_its_own_exponent() {
        let work = |scene: &str, name, x: f64, y: f64| Point {
            parameter: Some(Parameter { name, value: x }),
            ..point(Topic::Work, scene, (x, y))
        };
        let mut points = Vec::new();
        for x in [1.0, 2.0, 4.0] {
            points.push(work("a", "rays", x, 3.0 * x));
            points.push(work("b", "rays", x, x * x));
            points.push(work("a", "sms", x, 1.0 / x));
            points.push(point(Topic::Model, "a", (x, x.powi(3))));
        }
        let found = growths(&points);
        let found: Vec<(&str, &str, f64)> =
            found.iter().map(|g| (g.scene.as_str(), g.parameter, (1e9 * g.exponent.exponent).round() / 1e9)).collect();
        assert_eq!(found, [("a", "rays", 1.0), ("b", "rays", 2.0), ("a", "sms", -1.0)]);
    }
}
