//! Figures 2 to 4, and the ratios of Tables II and III beside the paper's.

use super::{Cluster, RAYS, Report, Row, published};
use crate::report::chart::{Axis, Chart, Series, Style};

/// The charts of a report: figures 2, 3 (two) and 4, ratios of miss rates and of cycles.
pub fn charts(report: &Report) -> Vec<Chart> {
    let figure = |title: &str, y: Axis, note: &str, of: fn(&Cluster) -> f64| Chart {
        title: title.to_owned(),
        x: Axis::linear("SM clusters", ""),
        y,
        series: RAYS.map(|rays| line(report, rays, of)).into(),
        note: note.to_owned(),
    };
    let [speed, latency, misses] = published::FIGURES;
    let speed = &format!("{speed} {}", secondary_speed(report));
    let mut speed =
        figure("Figure 2: speed, conference room", Axis::linear("speed", "Mrays/s"), speed, |c| c.mrays_per_s);
    for rays in RAYS {
        let alone = report.clusters.iter().find(|c| c.rays == rays && c.sms == 1).map_or(0.0, |c| c.mrays_per_s);
        let linear = report.clusters.iter().filter(|c| c.rays == rays);
        let points = linear.map(|c| (f64::from(c.sms), f64::from(c.sms) * alone));
        speed.series.push(Series::new(format!("{rays}, linear"), Style::Line, points));
    }
    vec![
        speed,
        figure("Figure 3: memory latency", Axis::linear("L1 miss to line", "cycles"), latency, |c| c.latency),
        figure("Figure 3: misses of the L2", Axis::linear("misses an L2 access", ""), "", |c| c.l2_miss),
        figure("Figure 4: misses of the L1", Axis::linear("misses an L1 access", ""), misses, |c| c.l1_miss),
        ratios(report, "Table II: misses, improved over standard", |row| (row.miss_ratio, row.paper_miss_ratio)),
        ratios(report, "Table III: cycles, improved over standard", |row| (row.cycle_ratio, row.paper_cycle_ratio)),
    ]
}

/// What becomes of the decline that the paper sees.
fn secondary_speed(report: &Report) -> String {
    let at = |sms| report.clusters.iter().find(|c| c.rays == RAYS[1] && c.sms == sms);
    let (Some(one), Some(knee), Some(most)) = (at(1), at(published::KNEE), report.clusters.last()) else {
        return String::new();
    };
    let factor = most.mrays_per_s / knee.mrays_per_s;
    let verdict = if factor < 1.0 { "they decline" } else { "they do not decline" };
    format!(
        "Here {verdict}: {:.1} Mrays/s on {} clusters, {:.1} on {}, {factor:.2} times as much where linear is {:.2}. A \
         miss takes {:.0} cycles on one cluster and {:.0} on {}: the network is far from full.",
        knee.mrays_per_s,
        knee.sms,
        most.mrays_per_s,
        most.sms,
        f64::from(most.sms) / f64::from(knee.sms),
        one.latency,
        most.latency,
        most.sms
    )
}

fn line(report: &Report, rays: &str, of: fn(&Cluster) -> f64) -> Series {
    let points = report.clusters.iter().filter(|c| c.rays == rays).map(|c| (f64::from(c.sms), of(c)));
    Series::new(rays, Style::Line, points)
}

/// Ours over the paper's, one point a row, and the line on which they are equal.
fn ratios(report: &Report, title: &str, of: fn(&Row) -> (f64, f64)) -> Chart {
    let mut series: Vec<Series> = RAYS
        .iter()
        .map(|&rays| {
            let rows = report.rows.iter().filter(|row| row.rays == rays);
            Series::new(rays, Style::Points, rows.map(|row| (of(row).1, of(row).0)))
        })
        .collect();
    series.push(Series::new("equal", Style::Line, [(0.0, 0.0), (1.0, 1.0)]));
    Chart {
        title: title.to_owned(),
        x: Axis::linear("the paper's ratio", ""),
        y: Axis::linear("our ratio", ""),
        series,
        note: "the paper's accounting: virtual caches, queues free".to_owned(),
    }
}
