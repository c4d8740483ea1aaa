//! Benchmarks in the formats of services that keep and chart them.

use serde_json::{Map, Value, json};

use super::bench::{Outcome, Report};

/// Bencher Metric Format (<https://bencher.dev/docs/reference/bencher-metric-format/>): benchmark, measure, value with
/// bounds. `throughput`, in operations a second, is a measure that Bencher knows; here an operation is a ray.
pub fn bencher(report: &Report) -> Value {
    let row = |outcome: &Outcome| {
        let mut measures = Map::new();
        if let Some(rate) = outcome.mrays_per_s {
            let rays = |mrays: f64| mrays * 1e6;
            let bounds = json!({
                "value": rays(rate.median), "lower_value": rays(rate.low), "upper_value": rays(rate.high),
            });
            measures.insert("throughput".to_owned(), bounds);
        }
        for (measure, value) in per_ray(outcome) {
            measures.insert(measure.replace(' ', "-"), json!({ "value": value }));
        }
        (name(report, outcome), Value::Object(measures))
    };
    Value::Object(report.results.iter().map(row).collect())
}

/// `customSmallerIsBetter` of github-action-benchmark (<https://github.com/benchmark-action/github-action-benchmark>,
/// section "Use custom benchmark result"): a list of names, units and values. Times a ray rather than rays a second, so
/// that less is better in every row and one file serves.
pub fn github_action(report: &Report) -> Value {
    let rows = report.results.iter().flat_map(|outcome| {
        let name = name(report, outcome);
        let time = outcome.mrays_per_s.map(|rate| {
            let nanoseconds = |mrays: f64| 1e3 / mrays;
            let range = format!("{:.4} to {:.4}", nanoseconds(rate.high), nanoseconds(rate.low));
            json!({"name": format!("{name} time"), "unit": "ns/ray", "value": nanoseconds(rate.median), "range": range})
        });
        let counters = per_ray(outcome)
            .map(|(measure, value)| json!({"name": format!("{name} {measure}"), "unit": "1/ray", "value": value}));
        time.into_iter().chain(counters).collect::<Vec<_>>()
    });
    Value::Array(rows.collect())
}

fn name(report: &Report, outcome: &Outcome) -> String {
    format!("{}/{}/{}", report.head.scene.name, outcome.tracing.strategy.name(), outcome.rays.name())
}

/// Exact counters: the same on every machine.
fn per_ray(outcome: &Outcome) -> [(&'static str, f64); 2] {
    let each = |sum: u64| sum as f64 / outcome.ray_count.max(1) as f64;
    let counters = &outcome.counters;
    [("node visits", each(counters.node_visits)), ("triangle tests", each(counters.triangle_tests))]
}
