//! Contention: the throughput of a saturated memory, of which a fixed point is not found by iterating.

use super::naive::fixed_point;
use super::{Effort, Finding, Study, worst};
use crate::Result;
use crate::fermi::contention::Stage;
use crate::report::chart::{Axis, Chart, Series, Style};

/// Iterations after which a fixed point should have settled.
const ROUNDS: usize = 1000;

/// Of the last iterates, so many are looked at.
const LAST: usize = 20;

pub fn study(_effort: Effort) -> Result<Study> {
    // 100 times saturation and less, and no load at all.
    let loads: Vec<f64> = [0.0].into_iter().chain((-20..=20).map(|k| 10f64.powf(f64::from(k) * 0.1))).collect();
    let each = |of: &dyn Fn(&Stage) -> f64| -> Vec<(f64, f64)> { loads.iter().map(|&x| (x, of(&stage(x)))).collect() };
    let last = |damping: f64| move |s: &Stage| fixed_point(s, damping, ROUNDS)[ROUNDS - 1] / capacity(s);
    let flips = |damping: f64| {
        each(&move |s| {
            let all = fixed_point(s, damping, ROUNDS);
            let (low, high) = all[ROUNDS - LAST..].iter().fold((f64::MAX, 0.0f64), |(l, h), &x| (l.min(x), h.max(x)));
            (high - low) / capacity(s)
        })
    };
    let own = each(&|s| (s.throughput() - bisection(s)).abs() / capacity(s));
    let finding = |naive, failure: Vec<(f64, f64)>| Finding {
        method: "contention",
        regime: "load 0 to 100 times saturation".to_owned(),
        measure: "throughput unsettled or wrong, part of the capacity",
        naive,
        naive_failure: worst(&failure),
        failure: worst(&own),
        uses: "closed form of a closed network, compared with bisection (fermi/contention.rs)",
    };
    Ok(Study {
        about: "Requests that think, then queue for a memory with fixed service (M/D/1 and Little's law), up to 100 times \
                as many as saturate it.",
        findings: vec![
            finding("iteration of the mean wait", flips(0.0)),
            finding("the same, half of the old value kept", flips(0.5)),
        ],
        charts: vec![
            Chart {
                title: "Throughput against load".to_owned(),
                x: Axis::log("load", "requests over those that saturate"),
                y: Axis::linear("throughput", "part of the capacity"),
                series: vec![
                    Series::new("iteration, its 1000th value", Style::Points, each(&last(0.0))),
                    Series::new("damped, likewise", Style::Points, each(&last(0.5))),
                    Series::new("bisection", Style::Line, each(&|s| bisection(s) / capacity(s))),
                    Series::new("closed form (this program)", Style::Line, each(&|s| s.throughput() / capacity(s))),
                ],
                note: format!("thinking {THINK} cycles, service {SERVICE} cycles"),
            },
            Chart {
                title: "How far the last 20 of 1000 iterates lie apart".to_owned(),
                x: Axis::log("load", "requests over those that saturate"),
                y: Axis::log("spread", "part of the capacity"),
                series: vec![
                    Series::new("iteration", Style::Line, flips(0.0)),
                    Series::new("damped", Style::Line, flips(0.5)),
                    Series::new("closed form against bisection", Style::Line, own),
                ],
                note: String::new(),
            },
        ],
    })
}

const THINK: f64 = 295.0;
const SERVICE: f64 = 4.545;

/// A memory under `load` times the requests that would saturate it without any queue.
fn stage(load: f64) -> Stage {
    Stage { customers: load * (THINK + SERVICE) / SERVICE, think: THINK, servers: 1.0, service: SERVICE }
}

fn capacity(stage: &Stage) -> f64 {
    stage.servers / stage.service
}

/// Throughput by halving the interval in which the utilization must lie: the customers it takes rise with it.
fn bisection(stage: &Stage) -> f64 {
    let taken = |rho: f64| {
        let wait = stage.service * rho / (2.0 * (1.0 - rho));
        rho * capacity(stage) * (stage.think + stage.service + wait)
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if taken(middle) < stage.customers { low = middle } else { high = middle }
    }
    low * capacity(stage)
}
