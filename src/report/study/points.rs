//! What a study measured: one point a value, and which of them nothing beats.

use serde::Serialize;

use crate::report::chart::{self, front};
use crate::report::statistics::Median;

/// Fewest repetitions whose order statistics cover the median with 95 %.
pub const REPETITIONS: usize = 6;

/// What is studied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Topic {
    /// How exactly a machine is modelled.
    Model,
    /// How many samples a pixel gets.
    Image,
    /// How rays are traced.
    Traversal,
    /// How cost grows with work.
    Work,
}

/// All topics, in the order of the page.
pub const TOPICS: [Topic; 4] = [Topic::Model, Topic::Image, Topic::Traversal, Topic::Work];

impl Topic {
    /// Name in files and of files.
    pub fn name(self) -> &'static str {
        match self {
            Topic::Model => "model",
            Topic::Image => "image",
            Topic::Traversal => "traversal",
            Topic::Work => "work",
        }
    }
}

/// What was measured; the names are those of `study.json`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Core cycles of the modelled machine.
    Cycles,
    /// Misses an access of its first-level caches.
    L1MissRate,
    /// Cycles, beside those of the simulator.
    SimulatorCycles,
    /// Misses an access, beside those of the simulator.
    SimulatorL1MissRate,
    /// Root mean square difference to the converged picture.
    Rmse,
    /// FLIP's mean difference to the converged picture.
    Flip,
    /// Million rays a second.
    MraysPerS,
    /// Inner nodes that a ray visits, mean.
    NodeVisitsPerRay,
    /// Seconds to build the BVH.
    BuildSeconds,
    /// Bytes of nodes and triangles.
    MemoryBytes,
}

/// The number that was varied to get from one point to the next.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// What it is: `spp`, `node_bytes`, `triangles`, `rays` or `sms`.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
}

/// One measured value.
#[derive(Clone, Debug, Serialize)]
pub struct Point {
    /// What is studied.
    pub chart: Topic,
    /// What was measured.
    pub quantity: Quantity,
    /// The scene.
    pub scene: String,
    /// Kind of the rays; `all` for pictures.
    pub rays: &'static str,
    /// How it was measured: a fidelity, a strategy, a format of nodes.
    pub method: String,
    /// What was varied, if anything was.
    pub parameter: Option<Parameter>,
    /// Seconds that it took: of CPU time for models, else by the clock of the device or the wall.
    pub seconds: f64,
    /// The value.
    pub value: f64,
    /// What it should be, where that is known.
    pub reference: Option<f64>,
    /// How far it is from that, never negative: relative for numbers, absolute for pictures.
    pub error: Option<f64>,
    /// Low and high end of the 95 % interval of `value`, where it was measured repeatedly.
    pub interval: Option<[f64; 2]>,
    /// Whether no other point of its chart is cheaper and better.
    pub on_front: bool,
    /// Its place in its chart: cost, what it buys, and the interval of that.
    #[serde(skip)]
    pub place: chart::Point,
}

/// What a point is of.
#[derive(Clone, Debug)]
pub struct Row<'a> {
    /// What is studied.
    pub chart: Topic,
    /// The scene.
    pub scene: &'a str,
    /// Kind of the rays.
    pub rays: &'static str,
    /// How it is measured.
    pub method: String,
    /// What is varied.
    pub parameter: Option<Parameter>,
}

impl Row<'_> {
    /// A value with its 95 % interval that took `seconds`, shown at `place`. What it should be is not known.
    pub fn point(&self, quantity: Quantity, seconds: f64, (value, interval): Measured, place: chart::Point) -> Point {
        Point {
            chart: self.chart,
            quantity,
            scene: self.scene.to_owned(),
            rays: self.rays,
            method: self.method.clone(),
            parameter: self.parameter,
            seconds,
            value,
            reference: None,
            error: None,
            interval,
            on_front: false,
            place,
        }
    }
}

/// A value, and its 95 % interval where there is one.
pub type Measured = (f64, Option<[f64; 2]>);

impl Point {
    /// Points that are shown together.
    pub fn group(&self) -> (Topic, Quantity, &str, &str) {
        (self.chart, self.quantity, &self.scene, self.rays)
    }
}

/// Indices of points that are shown together, groups in the order of their first points.
pub fn groups(points: &[Point], of: Topic) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (i, point) in points.iter().enumerate().filter(|(_, point)| point.chart == of) {
        match groups.iter_mut().find(|group| points[group[0]].group() == point.group()) {
            Some(group) => group.push(i),
            None => groups.push(vec![i]),
        }
    }
    groups
}

/// Says of each point whether it is on the front of its group. Work has none: more of it is not worse.
pub fn mark_fronts(points: &mut [Point]) {
    for topic in [Topic::Model, Topic::Image, Topic::Traversal] {
        for group in groups(points, topic) {
            let places: Vec<(f64, f64)> = group.iter().map(|&i| (points[i].place.x, points[i].place.y)).collect();
            front(&places).into_iter().for_each(|k| points[group[k]].on_front = true);
        }
    }
}

/// The value of repeated measurements, and its 95 % interval if there were enough of them.
pub fn repeated(values: &[f64]) -> Option<Measured> {
    let median = Median::of(values)?;
    Some((median.median, (values.len() >= REPETITIONS).then_some([median.low, median.high])))
}

/// Relative error of `value`, without its sign; 0 where both are 0.
pub fn relative_error(value: f64, reference: f64) -> f64 {
    if value == reference { 0.0 } else { (value / reference - 1.0).abs() }
}

/// Least and largest relative error of the values in an interval.
pub fn error_interval([low, high]: [f64; 2], reference: f64) -> [f64; 2] {
    let (a, b) = (relative_error(low, reference), relative_error(high, reference));
    let least = if (low..=high).contains(&reference) { 0.0 } else { a.min(b) };
    [least, a.max(b)]
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A point at a place of the chart of `topic`.
    pub fn point(chart: Topic, scene: &str, (x, y): (f64, f64)) -> Point {
        let row = Row { chart, scene, rays: "primary", method: format!("method {x}"), parameter: None };
        Point { error: Some(y), ..row.point(Quantity::Cycles, x, (y, None), (x, y).into()) }
    }

    #[test]
    fn fronts_are_those_of_each_group_and_work_has_none() {
        let place = [(1.0, 3.0), (2.0, 4.0), (3.0, 1.0)];
        let mut points: Vec<Point> = place.iter().map(|&at| point(Topic::Model, "a", at)).collect();
        points.extend(place.iter().map(|&at| point(Topic::Work, "a", at)));
        points.insert(1, point(Topic::Model, "b", (9.0, 9.0)));
        mark_fronts(&mut points);
        let marked: Vec<bool> = points.iter().map(|point| point.on_front).collect();
        assert_eq!(marked, [true, true, false, true, false, false, false]);
        assert_eq!(groups(&points, Topic::Model), [vec![0, 2, 3], vec![1]]);
    }

    #[test]
    fn few_repetitions_have_a_median_and_no_interval() {
        assert_eq!(repeated(&[]), None);
        assert_eq!(repeated(&[3.0, 1.0, 2.0]), Some((2.0, None)));
        assert_eq!(repeated(&[6.0, 1.0, 2.0, 3.0, 4.0, 5.0]), Some((3.5, Some([1.0, 6.0]))));
    }

    #[test]
    fn errors_have_no_sign_and_an_interval_that_holds_the_reference_begins_at_zero() {
        assert_eq!((relative_error(0.0, 0.0), relative_error(5.0, 10.0), relative_error(15.0, 10.0)), (0.0, 0.5, 0.5));
        assert_eq!(error_interval([8.0, 15.0], 10.0), [0.0, 0.5]);
        assert_eq!(error_interval([12.5, 15.0], 10.0), [0.25, 0.5]);
        assert_eq!(error_interval([5.0, 7.5], 10.0), [0.25, 0.5]);
    }
}
