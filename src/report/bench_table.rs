//! The benchmark as tables for people.

use std::fmt::Write;

use super::bench::Report;
use super::head::Head;
use crate::trace::accounting::SmCounters;

/// A line a strategy and kind of rays, what explains the speed of strategy `migrate`, and what the driver says of the
/// kernels.
pub fn table(report: &Report) -> String {
    let Head { machine, scene, width, height, .. } = &report.head;
    let mut text = format!("{}: {} triangles, {width} x {height}, {}\n\n", scene.name, scene.triangles, machine.device);
    let _ = writeln!(
        text,
        "{:<10} {:<9} {:<8} {:>10} {:>10} {:>22} {:>10} {:>10} {:>6}  hits digest",
        "strategy", "nodes", "rays", "count", "hits", "Mrays/s (95 %)", "nodes/ray", "tests/ray", "SIMD"
    );
    for r in &report.results {
        let each = |sum: u64| sum as f64 / r.ray_count.max(1) as f64;
        let rate = r.mrays_per_s.map_or("-".to_owned(), |m| format!("{:.3} ({:.3}-{:.3})", m.median, m.low, m.high));
        let _ = writeln!(
            text,
            "{:<10} {:<9} {:<8} {:>10} {:>10} {:>22} {:>10.2} {:>10.2} {:>6.3}  {}",
            r.tracing.strategy.name(),
            r.tracing.nodes.name(),
            r.rays.name(),
            r.ray_count,
            r.hits,
            rate,
            each(r.counters.node_visits),
            each(r.counters.triangle_tests),
            r.warps.simd_efficiency(),
            r.hits_digest
        );
    }
    migration_table(&mut text, report);
    for (kernel, statistics) in &report.kernels {
        let parts: Vec<String> = statistics.iter().map(|(name, value)| format!("{name} {value}")).collect();
        let _ = writeln!(text, "{kernel}: {}", parts.join(", "));
    }
    text
}

/// What explains the speed of strategy `migrate`.
fn migration_table(text: &mut String, report: &Report) {
    for (i, r) in report.results.iter().filter(|r| r.migration.is_some()).enumerate() {
        let Some(migration) = &r.migration else { continue };
        if i == 0 {
            let partition = r.tracing.partition.as_deref().unwrap_or_default();
            let _ = writeln!(text, "\nmigrate, {partition}; a ray's means");
            let _ = writeln!(
                text,
                "{:<8} {:>9} {:>9} {:>9} {:>9} {:>9} {:>7} {:>11} {:>9} {:>10}",
                "rays",
                "top nodes",
                "subtrees",
                "bypasses",
                "migrated",
                "bytes",
                "rounds",
                "mean queue",
                "longest",
                "busiest SM"
            );
        }
        let each = |sum: u64| sum as f64 / migration.rays.max(1) as f64;
        let queued: u64 = migration.rounds.iter().map(|round| round.queued).sum();
        let queues: u64 = migration.rounds.iter().map(|round| round.queues).sum();
        let steps = |sm: &SmCounters| sm.warps.warp_steps;
        let all: u64 = migration.sms.iter().map(steps).sum();
        let busiest = migration.sms.iter().map(steps).max().unwrap_or(0);
        let _ = writeln!(
            text,
            "{:<8} {:>9.2} {:>9.2} {:>9.2} {:>9.2} {:>9.0} {:>7} {:>11.1} {:>9} {:>9.2}x",
            r.rays.name(),
            each(r.counters.top_visits),
            each(r.counters.subtrees),
            each(r.counters.bypasses),
            each(r.counters.migrations),
            each(migration.sms.iter().map(|sm| sm.record_bytes).sum()),
            migration.rounds.len(),
            queued as f64 / queues.max(1) as f64,
            migration.rounds.iter().map(|round| round.longest_queue).max().unwrap_or(0),
            busiest as f64 * migration.sms.len() as f64 / all.max(1) as f64
        );
    }
}
