//! The report as a web page, and as text for a terminal.

use std::fmt::Write;

use super::charts::{charts, what};
use super::points::{Point, TOPICS, Topic};
use super::{Report, work::Growth};
use crate::Result;
use crate::report::chart;
use crate::report::html::{self, Section};

/// Charts a row.
pub const COLUMNS: usize = 2;

/// Heading of a topic, and how to read its charts.
fn about(topic: Topic) -> (&'static str, &'static str) {
    match topic {
        Topic::Model => (
            "Models",
            "Each way to predict a machine, against the replay of all cycles, which is the reference here and has error 0. \
         CPU time is that of recording where rays go and of modelling it, on all cores together; beside the simulator \
         also of reading its files. Values without an interval are deterministic.",
        ),
        Topic::Image => (
            "Pictures",
            "Pictures of 1, 2, 4, ... samples a pixel against one of four times the most samples and another seed. Strategies \
         give the same pictures to the last bit, so they differ in time alone. Pictures of few samples are repeated with \
         six seeds: values are medians, bars their 95 % intervals. At most samples about a tenth of RMSE is noise of \
         the converged picture.",
        ),
        Topic::Traversal => (
            "Traversal",
            "Strategies with nodes of 64 bytes, and of 32 with planes on a grid. All of them found the same hits, to the \
         last bit. Bars are 95 % intervals of the median of six runs; node visits are counted and exact. Time of a \
         software driver or of the CPU twin says nothing of a GPU.",
        ),
        Topic::Work => (
            "Work",
            "How cost grows with triangles (procedural scenes), rays (sizes of the picture) and multiprocessors (of the \
         modelled machine), for camera rays. Exponents are slopes of the lines by least squares, with 95 % intervals, \
         which tell how well a power law describes them. Procedural scenes are seen in pictures of a quarter of the width \
         and height.",
        ),
    }
}

/// One self-contained page.
///
/// # Errors
/// [`crate::Error::Check`] if a number cannot be charted.
pub fn page(report: &Report) -> Result<String> {
    let mut sections = vec![Section::Paragraph(summary(report))];
    for topic in TOPICS {
        let (heading, explanation) = about(topic);
        sections.push(Section::Heading(heading.to_owned()));
        sections.push(Section::Paragraph(explanation.to_owned()));
        sections.push(Section::Figure(chart::svg(&charts(report, topic), COLUMNS)?));
        if topic == Topic::Work {
            let rows = report.exponents.iter().map(|growth| growth.cells().to_vec()).collect();
            sections.push(Section::Table(GROWTH_HEAD.map(str::to_owned).to_vec(), rows));
        }
        let rows = report.points.iter().filter(|point| point.chart == topic).map(row).collect();
        sections.push(Section::Table(HEAD.map(str::to_owned).to_vec(), rows));
    }
    sections.push(Section::Heading("Time".to_owned()));
    let parts = report.parts.iter().map(|part| vec![part.name.clone(), format!("{:.1}", part.seconds)]).collect();
    sections.push(Section::Table(["part", "seconds"].map(str::to_owned).to_vec(), parts));
    if !report.left_out.is_empty() {
        let rows = report.left_out.iter().map(|left| vec![left.what.clone(), left.why.clone()]).collect();
        sections.push(Section::Table(["left out", "why"].map(str::to_owned).to_vec(), rows));
    }
    Ok(html::page("Speed against accuracy", &sections))
}

/// For people at a terminal: what is on the fronts, exponents, and what was left out.
pub fn text(report: &Report) -> String {
    let mut text = summary(report) + "\n\nOn the Pareto fronts:\n";
    for point in report.points.iter().filter(|point| point.on_front) {
        let [quantity, scene, rays, method, parameter, seconds, value, _, error, ..] = &cells(point);
        let _ = writeln!(
            text,
            "  {quantity:<18} {scene:<18} {rays:<8} {method:<17} {parameter:<18} {seconds:>10} s  value {value:>10}  error {error:>10}"
        );
    }
    text += "\nExponents, with 95 % intervals:\n";
    for growth in &report.exponents {
        let [quantity, parameter, scene, exponent] = growth.cells();
        let _ = writeln!(text, "  {quantity:<22} over {parameter:<10} {scene:<18} {exponent}");
    }
    if !report.left_out.is_empty() {
        text += "\nLeft out:\n";
    }
    for left in &report.left_out {
        let _ = writeln!(text, "  {}: {}", left.what, left.why);
    }
    text
}

fn summary(report: &Report) -> String {
    let within = report.tolerance.map_or(String::new(), |x| format!(", growth of cycles by samples within {x}"));
    format!(
        "{} x {} pixels. Pictures and traversal on {} ({} host threads), models of {}{}. Measured in {:.0} s with Caribou {}.",
        report.width,
        report.height,
        report.machine.device,
        report.machine.threads,
        report.model,
        within,
        report.seconds,
        report.machine.caribou
    )
}

const HEAD: [&str; 11] = [
    "quantity",
    "scene",
    "rays",
    "method",
    "varied",
    "seconds",
    "value",
    "reference",
    "error",
    "95 % interval",
    "on the front",
];

fn row(point: &Point) -> Vec<String> {
    cells(point).to_vec()
}

fn cells(point: &Point) -> [String; 11] {
    let optional = |value: Option<f64>| value.map_or("-".to_owned(), number);
    [
        match point.quantity {
            super::Quantity::MraysPerS => "Mrays/s".to_owned(),
            quantity => what(quantity).0.to_owned(),
        },
        point.scene.clone(),
        point.rays.to_owned(),
        point.method.clone(),
        point.parameter.map_or("-".to_owned(), |p| format!("{} {}", p.value, p.name.replace('_', " "))),
        number(point.seconds),
        number(point.value),
        optional(point.reference),
        optional(point.error),
        point.interval.map_or("-".to_owned(), |[low, high]| format!("{} to {}", number(low), number(high))),
        if point.on_front { "yes" } else { "" }.to_owned(),
    ]
}

const GROWTH_HEAD: [&str; 4] = ["quantity", "over", "scene", "exponent"];

impl Growth {
    fn cells(&self) -> [String; 4] {
        [what(self.quantity).0.to_owned(), self.parameter.to_owned(), self.scene.clone(), self.exponent.text()]
    }
}

/// Four digits, however small or large.
fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = 3 - value.abs().log10().floor() as i32;
    match digits {
        0..=7 => format!("{value:.*}", digits as usize),
        -6..0 => format!("{value:.0}"),
        _ => format!("{value:.3e}"),
    }
}
