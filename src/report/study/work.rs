//! How cost grows with work: triangles, rays and multiprocessors.

use std::time::Instant;

use cpu_time::ProcessTime;
use serde::Serialize;

use super::fit::Exponent;
use super::points::{Parameter, Point, Quantity, REPETITIONS, Topic, repeated};
use super::{KERNEL, Request, Steps, Subject};
use crate::Result;
use crate::bvh::statistics::Statistics;
use crate::bvh::{Bvh, Quality};
use crate::fermi::result::Fidelity;
use crate::render::rays::RayKind;
use crate::report::experiment::{Model, Recording};
use crate::scene::procedural;
use crate::shared::LEAF_BIT;
use crate::trace::Strategy;

/// Procedural scenes that grow: a common kind, and the worst for boxes.
const RECIPES: [&str; 2] = ["room", "needles"];

/// Builds of at most so many triangles are repeated, for an interval.
const MOST_REPEATED: usize = 100_000;

/// Multiprocessors up to those of the GeForce GTX 480, and twice as many.
const SMS: [u32; 6] = [1, 2, 4, 8, 15, 30];

/// Rays that are counted.
const KIND: RayKind = RayKind::Primary;

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

/// Sizes of pictures: each four times the pixels of the one before.
fn sizes(request: &Request) -> Vec<(u32, u32)> {
    let (width, height) = request.size;
    let smaller = [8, 4, 2, 1].map(|part| (width.div_ceil(part), height.div_ceil(part)));
    if request.quick { smaller[1..].to_vec() } else { smaller.to_vec() }
}

/// Things done by [`measure`] for one scene.
pub fn steps(request: &Request) -> usize {
    sizes(request).len() + SMS.len()
}

/// Things done by [`grow`].
pub fn grow_steps(request: &Request) -> usize {
    RECIPES.len() * triangles(request).len()
}

/// Cost over triangles, of procedural scenes.
///
/// # Errors
/// As of building.
pub fn grow(request: &Request, steps: &Steps) -> Result<Vec<Point>> {
    let mut points = Vec::new();
    for recipe in RECIPES {
        for count in triangles(request) {
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
            let row = Row { scene: recipe, parameter: Parameter { name: "triangles", value: count as f64 } };
            if let Some((median, interval)) = repeated(&seconds) {
                points.push(row.point(Quantity::BuildSeconds, "build", median, (median, interval)));
                points.push(row.point(Quantity::MemoryBytes, "build", median, (bytes, None)));
            }
            let subject = Subject::new(recipe, scene, bvh)?;
            let rays = subject.rays(request.size, KIND)?;
            let recording = subject.record(&rays, KIND);
            points.push(row.visits(&recording));
            points.push(row.cycles(&request.machine, None, &recording)?);
            steps.done();
        }
    }
    Ok(points)
}

/// Cost of a scene over rays and over multiprocessors.
///
/// # Errors
/// Of rays that are not there, and of machines.
pub fn measure(request: &Request, subject: &Subject, steps: &Steps) -> Result<Vec<Point>> {
    let mut points = Vec::new();
    for size in sizes(request) {
        let rays = subject.rays(size, KIND)?;
        let recording = subject.record(&rays, KIND);
        let row = Row { scene: &subject.name, parameter: Parameter { name: "rays", value: rays.len() as f64 } };
        points.push(row.visits(&recording));
        points.push(row.cycles(&request.machine, None, &recording)?);
        steps.done();
    }
    let recording = subject.record(&subject.rays(request.size, KIND)?, KIND);
    for sms in SMS {
        let row = Row { scene: &subject.name, parameter: Parameter { name: "sms", value: sms.into() } };
        points.push(row.cycles(&request.machine, Some(sms), &recording)?);
        steps.done();
    }
    Ok(points)
}

/// What points are of.
struct Row<'a> {
    scene: &'a str,
    parameter: Parameter,
}

impl Row<'_> {
    fn visits(&self, (Recording { trace, .. }, seconds): &(Recording, f64)) -> Point {
        let nodes = trace.steps.iter().filter(|&step| step & LEAF_BIT == 0).count();
        let visits = nodes as f64 / trace.rays() as f64;
        self.point(Quantity::NodeVisitsPerRay, "recording", *seconds, (visits, None))
    }

    fn cycles(&self, machine: &str, sms: Option<u32>, (recording, recorded_in): &(Recording, f64)) -> Result<Point> {
        let settings: Vec<String> = sms.iter().map(|sms| format!("sms={sms}")).collect();
        let model = Model::new(machine, KERNEL, &settings, Fidelity::Cycles)?;
        let start = ProcessTime::now();
        let prediction = model.whole(&recording.recorded(), Strategy::Direct)?;
        let seconds = recorded_in + start.elapsed().as_secs_f64();
        Ok(self.point(Quantity::Cycles, "cycles", seconds, (prediction.cycles as f64, None)))
    }

    fn point(
        &self,
        quantity: Quantity,
        method: &str,
        seconds: f64,
        (value, interval): (f64, Option<[f64; 2]>),
    ) -> Point {
        Point {
            chart: Topic::Work,
            quantity,
            scene: self.scene.to_owned(),
            rays: KIND.name(),
            method: method.to_owned(),
            parameter: Some(self.parameter),
            seconds,
            value,
            reference: None,
            error: None,
            interval,
            on_front: false,
            place: crate::report::chart::Point { x: self.parameter.value, y: value, interval },
        }
    }
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
