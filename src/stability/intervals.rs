//! Intervals: how often a 95 % interval from a sample of warps holds the mean of all.

use rayon::prelude::*;

use super::naive::independent_rays;
use super::{Effort, Finding, Study};
use crate::Result;
use crate::report::chart::{Axis, Chart, Series, Style};
use crate::scene::procedural::random::Random;
use crate::shared::WARP;
use crate::statistics::{CONFIDENCE, Design, Estimate, bootstrap_t, student_t};

/// Warps of a population.
const WARPS: usize = 2000;

/// Resamples of a bootstrap.
const RESAMPLES: usize = 399;

/// Coverage of each of these.
const METHODS: [&str; 4] = [
    "normal, rays taken as independent",
    "Student's t over warps",
    "bootstrap-t over warps",
    "tail measured, rest by size (this program)",
];

/// Sizes of the sample, in warps.
const SAMPLES: [usize; 5] = [10, 20, 50, 100, 200];

/// Exponents of the Pareto distribution of the cost of warps: below 2 it has no variance.
const TAILS: [f64; 6] = [1.1, 1.3, 1.6, 2.0, 3.0, 6.0];

/// Sample of the chart over tails, and tail of the chart over samples.
const SAMPLE: usize = 50;
const TAIL: f64 = 1.3;

pub fn study(effort: Effort) -> Result<Study> {
    let repeats = effort.of(200, 1000);
    let over = |values: &[(f64, f64, usize)]| -> Vec<Vec<(f64, f64)>> {
        let coverages: Vec<(f64, [f64; 4])> =
            values.iter().map(|&(x, tail, sample)| (x, coverage(tail, sample, repeats))).collect();
        (0..METHODS.len()).map(|k| coverages.iter().map(|(x, all)| (*x, all[k])).collect()).collect()
    };
    let by_tail = over(&TAILS.map(|tail| (tail, tail, SAMPLE)));
    let by_sample = over(&SAMPLES.map(|sample| (sample as f64, TAIL, sample)));
    let least = |k: usize| by_tail[k].iter().chain(&by_sample[k]).map(|point| point.1).fold(1.0, f64::min);
    let finding = |k: usize| Finding {
        method: "intervals",
        regime: "10 to 200 of 2000 warps, Pareto tails of exponent 1.1 to 6".to_owned(),
        measure: "least part of the 95 % intervals that hold the mean",
        naive: METHODS[k],
        naive_failure: least(k),
        failure: least(3),
        uses: "the largest warps measured all, the others drawn by cost, Student's t (statistics/proportional.rs)",
    };
    let chart = |title: String, x: Axis, curves: &[Vec<(f64, f64)>]| {
        let nominal = curves[0].iter().map(|&(x, _)| (x, CONFIDENCE));
        let mut series: Vec<Series> =
            METHODS.iter().zip(curves).map(|(&name, curve)| Series::new(name, Style::Line, curve.clone())).collect();
        series.push(Series::new("what 95 % promises", Style::Line, nominal));
        Chart {
            title,
            x,
            y: Axis::linear("intervals that hold the mean", "part of all"),
            series,
            note: format!("{repeats} samples a point of {WARPS} warps of {WARP} rays"),
        }
    };
    Ok(Study {
        about: "Warps whose cost has a heavy tail, and whose rays resemble each other. A size that is known of each warp \
                beforehand tells its cost within a factor of two.",
        findings: (0..3).map(finding).collect(),
        charts: vec![
            chart(
                format!("Coverage against the weight of the tail, {SAMPLE} warps"),
                Axis::log("Pareto exponent", ""),
                &by_tail,
            ),
            chart(
                format!("Coverage against the size of the sample, exponent {TAIL}"),
                Axis::log("warps drawn", ""),
                &by_sample,
            ),
        ],
    })
}

/// Part of the samples whose interval holds the mean, by method.
fn coverage(tail: f64, sample: usize, repeats: usize) -> [f64; 4] {
    let covered = |repeat: u64| -> [bool; 4] {
        let random = &mut Random::stream(8, repeat);
        // No unit random number is 1.
        let sizes: Vec<f64> = (0..WARPS).map(|_| (1.0 - f64::from(random.unit())).powf(-1.0 / tail)).collect();
        let costs: Vec<f64> = sizes.iter().map(|size| size * f64::from(random.between(0.67, 1.33))).collect();
        let truth = costs.iter().sum::<f64>() / WARPS as f64;
        let drawn: Vec<f64> = (0..sample).map(|_| random.pick(&costs)).collect();
        let rays: Vec<f64> = drawn
            .iter()
            .flat_map(|cost| (0..WARP).map(|_| cost * f64::from(random.between(0.8, 1.2))).collect::<Vec<_>>())
            .collect();
        let design = Design::new(&sizes, sample);
        let holds = |estimate: Option<Estimate>| estimate.is_some_and(|estimate| estimate.holds(truth));
        [
            independent_rays(&rays).holds(truth),
            holds(student_t(&drawn, CONFIDENCE)),
            holds(bootstrap_t(&drawn, CONFIDENCE, RESAMPLES, random.bits())),
            holds(design.mean(&design.draw(random.bits()), |i| costs[i], CONFIDENCE)),
        ]
    };
    let all: Vec<[bool; 4]> = (0..repeats as u64).into_par_iter().map(covered).collect();
    [0, 1, 2, 3].map(|k| all.iter().filter(|covered| covered[k]).count() as f64 / repeats as f64)
}
