//! The report as a web page, as text for a terminal, and as comma-separated values.

use std::fmt::Write;

use super::jobs::Used;
use super::{Report, Request, charts};
use crate::Result;
use crate::fermi::result::Fidelity;
use crate::report::chart;
use crate::report::html::{self, Section};
use crate::report::model::name;

/// A table: names of columns, and rows.
type Table = (Vec<String>, Vec<Vec<String>>);

/// One self-contained page.
///
/// # Errors
/// [`crate::Error::Check`] if a number cannot be charted.
pub fn page(report: &Report) -> Result<String> {
    let charts = charts(report);
    let figure = |range: std::ops::Range<usize>| chart::svg(&charts[range], 2).map(Section::Figure);
    let heading = |text: &str| Section::Heading(text.to_owned());
    let paragraph = |text: String| Section::Paragraph(text);
    let table = |(head, rows): Table| Section::Table(head, rows);
    let mut sections = vec![
        paragraph(summary(report)),
        heading("Table I: scenes"),
        table(scenes(report)),
        heading("Tables II and III: miss rate and cycles"),
        paragraph(ACCOUNTINGS.to_owned()),
        table(misses(report)),
        table(cycles(report)),
        figure(4..6)?,
        heading("Figures 2 to 4: more multiprocessors"),
        figure(0..4)?,
        heading("What the paper leaves open"),
        paragraph(format!("The paper does not say: {}.", report.open.join("; "))),
    ];
    if !report.sensitivity.is_empty() {
        sections.push(paragraph(
            "Each line changes one setting of the tables above. Differences are means over the eight rows; ratios are \
             improved over standard, primary rays of the four scenes, then secondary."
                .to_owned(),
        ));
        sections.push(table(sensitivity(report)));
    }
    Ok(html::page("Thread migration: Zhu and Deng 2013, and what this model says", &sections))
}

const ACCOUNTINGS: &str = "The paper's accounting gives every subtree a virtual first-level cache as large as the real \
    one and charges nothing for scheduling and queues. Full accounting has one real cache a multiprocessor and charges \
    the walk of the top tree, queues and multiprocessors that wait.";

/// For people: tables II and III, and how far they are from the paper's.
pub fn text(report: &Report) -> String {
    let mut text = summary(report) + "\n\n";
    for (head, rows) in [misses(report), cycles(report)] {
        let widths: Vec<usize> = (0..head.len())
            .map(|column| rows.iter().map(|row| row[column].len()).chain([head[column].len()]).max().unwrap_or(0))
            .collect();
        for row in std::iter::once(&head).chain(&rows) {
            let cells = row.iter().zip(&widths).map(|(cell, &width)| format!("{cell:>width$}"));
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{}", cells.collect::<Vec<_>>().join("  "));
        }
        text.push('\n');
    }
    text
}

fn summary(report: &Report) -> String {
    let Request { size, secondary, migrate, model, sampling, .. } = &report.request;
    let full = report.rows.iter().map(|row| row.full_cycle_ratio).fold(f64::INFINITY, f64::min);
    let sorted = if secondary.sorted { ", sorted" } else { "" };
    let tolerance =
        sampling.map_or(String::new(), |sampling| format!(" Tolerance {}: {}.", sampling.tolerance, used(report)));
    format!(
        "{} on {}, fidelity {}, {} x {} pixels, secondary rays: {} ({} a hit{sorted}); subtrees {}, grouping {}.{tolerance} \
         In the paper's accounting the eight ratios differ from the paper's by {:.3} (misses) and {:.3} (cycles) in the \
         mean. In full accounting migration takes {full:.1} times the cycles of the standard traversal at best.",
        model.kernel.name,
        model.machine.name,
        name(&model.fidelity),
        size.0,
        size.1,
        secondary.kind.name(),
        secondary.per_hit,
        migrate.partition,
        name(&migrate.grouping),
        report.difference.miss,
        report.difference.cycles,
    )
}

/// What the tolerance needed.
fn used(report: &Report) -> String {
    let way = |used: &Used| match used.fidelity {
        Fidelity::Sampled => format!(
            "{} runs of the standard traversal by samples, which replay {:.0} % of the warps",
            used.runs,
            100.0 * used.replayed as f64 / used.warps.max(1) as f64
        ),
        fidelity => format!(
            "{} runs of migration whole, as {}, because samples are of rays that stay in their warps",
            used.runs,
            name(&fidelity)
        ),
    };
    report.used.iter().map(way).collect::<Vec<_>>().join("; ")
}

fn owned<const N: usize>(cells: [&str; N]) -> Vec<String> {
    cells.map(str::to_owned).into()
}

fn scenes(report: &Report) -> Table {
    let head =
        ["scene", "from", "differs", "vertices", "paper", "triangles", "paper", "nodes", "leaves", "paper", "MiB"];
    let rows = report.scenes.iter().map(|scene| {
        vec![
            scene.paper.name.to_owned(),
            scene.source.clone(),
            scene.stand_in.clone().unwrap_or_else(|| "no".to_owned()),
            scene.vertices.to_string(),
            scene.paper.vertices.to_string(),
            scene.triangles.to_string(),
            scene.paper.triangles.to_string(),
            scene.nodes.to_string(),
            scene.leaves.to_string(),
            scene.paper.nodes.to_string(),
            format!("{:.1}", scene.bytes as f64 / f64::from(1 << 20)),
        ]
    });
    (owned(head), rows.collect())
}

fn misses(report: &Report) -> Table {
    let head =
        ["rays", "scene", "count", "standard", "paper", "improved", "paper", "ratio", "paper", "pending too", "full"];
    let rows = report.rows.iter().map(|row| {
        let rate = |rate: f64| format!("{rate:.4}");
        let share = |ratio: f64| format!("{ratio:.2}");
        vec![
            row.rays.to_owned(),
            row.scene.to_owned(),
            row.ray_count.to_string(),
            rate(row.miss_standard),
            rate(row.paper.miss_standard),
            rate(row.miss_improved),
            rate(row.paper.miss_improved),
            share(row.miss_ratio),
            share(row.paper_miss_ratio),
            share(row.miss_ratio_pending),
            rate(row.full_miss),
        ]
    });
    (owned(head), rows.collect())
}

fn cycles(report: &Report) -> Table {
    let head =
        ["rays", "scene", "standard", "paper", "improved", "paper", "ratio", "paper", "full cycles", "full ratio"];
    let rows = report.rows.iter().map(|row| {
        vec![
            row.rays.to_owned(),
            row.scene.to_owned(),
            row.cycles_standard.to_string(),
            format!("{:.0}", row.paper.cycles_standard),
            row.cycles_improved.to_string(),
            format!("{:.0}", row.paper.cycles_improved),
            format!("{:.2}", row.cycle_ratio),
            format!("{:.2}", row.paper_cycle_ratio),
            row.full_cycles.to_string(),
            format!("{:.2}", row.full_cycle_ratio),
        ]
    });
    (owned(head), rows.collect())
}

fn sensitivity(report: &Report) -> Table {
    let head =
        ["setting", "value", "misses differ", "with pending hits", "cycles differ", "ratios of misses", "of cycles"];
    let list = |ratios: &[f64]| ratios.iter().map(|ratio| format!("{ratio:.2}")).collect::<Vec<_>>().join(" ");
    let rows = report.sensitivity.iter().map(|row| {
        vec![
            row.setting.to_owned(),
            row.value.clone(),
            format!("{:.3}", row.difference.miss),
            format!("{:.3}", row.difference.miss_pending),
            format!("{:.3}", row.difference.cycles),
            list(&row.miss_ratios),
            list(&row.cycle_ratios),
        ]
    });
    (owned(head), rows.collect())
}

/// The rows of Tables II and III as comma-separated values.
pub fn csv(report: &Report) -> String {
    let mut text = "rays,scene,count,miss_standard,miss_improved,miss_ratio,paper_miss_ratio,cycles_standard,\
                    cycles_improved,cycle_ratio,paper_cycle_ratio,full_cycles,full_cycle_ratio\n"
        .to_owned();
    for r in &report.rows {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{},{},{},{},{},{},{},{},{},{},{},{},{}",
            r.rays,
            r.scene,
            r.ray_count,
            r.miss_standard,
            r.miss_improved,
            r.miss_ratio,
            r.paper_miss_ratio,
            r.cycles_standard,
            r.cycles_improved,
            r.cycle_ratio,
            r.paper_cycle_ratio,
            r.full_cycles,
            r.full_cycle_ratio
        );
    }
    text
}
