//! The points as charts.

use super::Report;
use super::points::{Point, Quantity, Topic, groups};
use super::work::Growth;
use crate::report::chart::{self, Axis, Chart, Series, Style, front};

/// Charts of a topic, each with the front of what it shows; growth of cost has none.
pub fn charts(report: &Report, topic: Topic) -> Vec<Chart> {
    if topic == Topic::Work {
        return grown(report);
    }
    let all = groups(&report.points, topic);
    let all = all.iter().map(|group| group.iter().map(|&i| &report.points[i]).collect::<Vec<_>>());
    let alone = all.filter(|group| !beside_simulator(group[0].quantity)).map(|group| tradeoff(&group));
    let pooled = [Quantity::SimulatorCycles, Quantity::SimulatorL1MissRate].into_iter().filter_map(|quantity| {
        let group: Vec<&Point> = of_topic(report, topic).filter(|point| point.quantity == quantity).collect();
        (!group.is_empty()).then(|| pooled(&group))
    });
    alone.chain(pooled).collect()
}

fn of_topic(report: &Report, topic: Topic) -> impl Iterator<Item = &Point> {
    report.points.iter().filter(move |point| point.chart == topic)
}

fn beside_simulator(quantity: Quantity) -> bool {
    matches!(quantity, Quantity::SimulatorCycles | Quantity::SimulatorL1MissRate)
}

/// Cost against what it buys: a series a method, and the front.
fn tradeoff(group: &[&Point]) -> Chart {
    let Point { chart, quantity, scene, rays, .. } = group[0];
    let front: Vec<chart::Point> =
        group.iter().filter(|point| point.on_front).map(|point| without_bar(point)).collect();
    let rays = if *rays == "all" { String::new() } else { format!(", {rays} rays") };
    Chart {
        title: format!("{scene}{rays}: {}", what(*quantity).0),
        x: cost(*chart),
        y: benefit(*chart, *quantity),
        series: with_front(methods(group), "Pareto front", front),
        note: String::new(),
    }
}

/// Many runs in one chart, with the front of the methods' means.
fn pooled(group: &[&Point]) -> Chart {
    let methods = methods(group);
    let mean = |points: &[chart::Point], of: fn(&chart::Point) -> f64| {
        points.iter().map(of).sum::<f64>() / points.len().max(1) as f64
    };
    let means: Vec<(f64, f64)> =
        methods.iter().map(|series| (mean(&series.points, |p| p.x), mean(&series.points, |p| p.y))).collect();
    let front = front(&means).into_iter().map(|i| means[i].into()).collect();
    Chart {
        title: format!("beside GPGPU-Sim: {}", what(group[0].quantity).0),
        x: cost(Topic::Model),
        y: benefit(Topic::Model, group[0].quantity),
        series: with_front(methods, "Pareto front of the means", front),
        note: "A point a run. The simulator's own error is 0 by definition; its time is known of some runs.".to_owned(),
    }
}

/// A series a method, in the order of their first points; a line where a number was varied.
fn methods(group: &[&Point]) -> Vec<Series> {
    split(group, |point| &point.method)
        .into_iter()
        .map(|(method, points)| {
            let varied = points.len() > 1 && points.iter().all(|point| point.parameter.is_some());
            let style = if varied { Style::Line } else { Style::Points };
            Series { points: points.iter().map(|point| point.place).collect(), ..Series::new(method, style, []) }
        })
        .collect()
}

/// The front lies below the methods, whose markers say what is on it.
fn with_front(methods: Vec<Series>, name: &str, points: Vec<chart::Point>) -> Vec<Series> {
    let front = Series { points, ..Series::new(name, Style::Front, []) };
    std::iter::once(front).chain(methods).collect()
}

/// The front repeats points whose intervals are drawn with their methods.
fn without_bar(point: &Point) -> chart::Point {
    chart::Point { interval: None, ..point.place }
}

/// Cost over work: a chart a quantity and parameter, with a series a scene that tells its exponent.
fn grown(report: &Report) -> Vec<Chart> {
    let points: Vec<&Point> = of_topic(report, Topic::Work).collect();
    let parameter = |point: &Point| point.parameter.map_or("", |parameter| parameter.name);
    let kinds = split(&points, |point| (point.quantity, parameter(point)));
    let chart = |((quantity, parameter), points): ((Quantity, &str), Vec<&Point>)| Chart {
        title: format!("{} over {}", what(quantity).0, work(parameter).label),
        x: work(parameter),
        y: benefit(Topic::Work, quantity),
        series: split(&points, |point| &point.scene)
            .into_iter()
            .map(|(scene, points)| {
                let grows = |g: &&Growth| (&g.scene, g.quantity, g.parameter) == (scene, quantity, parameter);
                let exponent = report.exponents.iter().find(grows).map(|growth| growth.exponent.text());
                let name = exponent.map_or(scene.clone(), |exponent| format!("{scene}: exponent {exponent}"));
                let points = points.iter().map(|point| point.place).collect();
                Series { points, ..Series::new(name, Style::Line, []) }
            })
            .collect(),
        note: String::new(),
    };
    kinds.into_iter().map(chart).collect()
}

/// Points by a key, keys in the order of their first points.
fn split<'a, K: PartialEq>(points: &[&'a Point], key: impl Fn(&'a Point) -> K) -> Vec<(K, Vec<&'a Point>)> {
    let mut parts: Vec<(K, Vec<&Point>)> = Vec::new();
    for &point in points {
        let key = key(point);
        match parts.iter_mut().find(|(known, _)| *known == key) {
            Some((_, part)) => part.push(point),
            None => parts.push((key, vec![point])),
        }
    }
    parts
}

/// What a quantity is called, and its unit.
pub(super) fn what(quantity: Quantity) -> (&'static str, &'static str) {
    match quantity {
        Quantity::Cycles | Quantity::SimulatorCycles => ("cycles", ""),
        Quantity::L1MissRate | Quantity::SimulatorL1MissRate => ("L1 miss rate", ""),
        Quantity::Rmse => ("RMSE", ""),
        Quantity::Flip => ("FLIP", ""),
        Quantity::MraysPerS => ("time a ray", "ns"),
        Quantity::NodeVisitsPerRay => ("node visits a ray", ""),
        Quantity::BuildSeconds => ("time to build the BVH", "s"),
        Quantity::MemoryBytes => ("memory", "bytes"),
    }
}

/// The horizontal axis of trade-offs.
fn cost(topic: Topic) -> Axis {
    match topic {
        Topic::Model => Axis::log("CPU time", "s"),
        Topic::Image | Topic::Work => Axis::log("time", "s"),
        Topic::Traversal => Axis::log("nodes", "MiB"),
    }
}

fn benefit(topic: Topic, quantity: Quantity) -> Axis {
    let (label, unit) = what(quantity);
    match (topic, quantity) {
        (Topic::Model, _) => Axis::log(&format!("relative error of {label}"), ""),
        (Topic::Image, _) => Axis::log(&format!("{label} to the converged picture"), ""),
        _ => Axis::log(label, unit),
    }
}

fn work(parameter: &str) -> Axis {
    Axis::log(if parameter == "sms" { "SMs" } else { parameter }, "")
}

#[cfg(test)]
mod tests {
    use super::super::points::{Parameter, mark_fronts, tests::point};
    use super::*;

    #[test]
    fn trade_offs_have_a_series_a_method_above_the_front() {
        let at = [(1.0, 3.0), (2.0, 4.0), (3.0, 0.0)];
        let mut points: Vec<Point> = at.iter().map(|&at| point(Topic::Model, "room", at)).collect();
        mark_fronts(&mut points);
        let chart = tradeoff(&points.iter().collect::<Vec<_>>());
        let names: Vec<&str> = chart.series.iter().map(|series| series.name.as_str()).collect();
        assert_eq!(names, ["Pareto front", "method 1", "method 2", "method 3"]);
        let front: Vec<(f64, f64)> = chart.series[0].points.iter().map(|p| (p.x, p.y)).collect();
        assert_eq!((front, chart.x.log, chart.y.log), (vec![(1.0, 3.0), (3.0, 0.0)], true, true));
        assert!(chart.svg().is_ok());
    }

    #[test]
    fn runs_of_a_method_are_pooled_and_the_front_is_of_means() {
        let run = |method: &str, at| Point {
            quantity: Quantity::SimulatorCycles,
            method: method.to_owned(),
            ..point(Topic::Model, "case", at)
        };
        let points = [run("a", (1.0, 0.2)), run("a", (3.0, 0.4)), run("b", (5.0, 0.1)), run("c", (9.0, 0.5))];
        let chart = pooled(&points.iter().collect::<Vec<_>>());
        let front: Vec<(f64, f64)> = chart.series[0].points.iter().map(|p| (p.x, p.y)).collect();
        assert_eq!(front.len(), 2);
        assert!((front[0].0 - 2.0).abs() < 1e-12 && (front[0].1 - 0.3).abs() < 1e-12 && front[1] == (5.0, 0.1));
    }

    #[test]
    fn varied_numbers_are_joined_by_lines_and_single_values_are_not() {
        let varied = |x: f64| Point {
            method: "direct".to_owned(),
            parameter: Some(Parameter { name: "spp", value: x }),
            ..point(Topic::Image, "room", (x, 1.0 / x))
        };
        let (a, b) = (varied(1.0), varied(2.0));
        assert_eq!(methods(&[&a, &b])[0].style, Style::Line);
        assert_eq!(methods(&[&a])[0].style, Style::Points);
    }
}
