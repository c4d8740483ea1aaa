//! Queues: SMs that starve because the rays are where others' subtrees are.

use super::naive::equal_numbers;
use super::shapes::ray_outside;
use super::{Effort, Finding, Study, worst};
use crate::Result;
use crate::bvh::{Bvh, Owners, Partition, Policy};
use crate::layout::Ray;
use crate::report::chart::{Axis, Chart, Series, Style};
use crate::scene::procedural;
use crate::trace::{MachineOptions, Query, Strategy, Totals, TracerOptions, TwinTracer};

/// SMs of a GeForce GTX 480.
const SMS: u32 = 15;

/// Parts of the scene's half diagonal that rays are spread over.
const SPREADS: [f64; 6] = [1.0, 0.5, 0.2, 0.1, 0.03, 0.01];

/// How many times the mean work the busiest SM has.
struct Balance {
    spread: f64,
    equal: f64,
    adjacent: f64,
    scattered: f64,
    /// Migrations a ray, of both.
    migrations: [f64; 2],
    /// With the hottest subtree as an SM's only one: what no assignment can beat.
    hottest: f64,
}

pub fn study(effort: Effort) -> Result<Study> {
    let rays = effort.of(10_000, 60_000);
    let bvh = Bvh::build(&procedural::build("forest", effort.of(20_000, 60_000), 1)?.positions, Default::default())?;
    let policy: Policy = "bytes:16KiB".parse()?;
    let all: Vec<Balance> = SPREADS.iter().map(|&spread| balance(&bvh, policy, spread, rays)).collect::<Result<_>>()?;
    let curve = |of: &dyn Fn(&Balance) -> f64| -> Vec<(f64, f64)> { all.iter().map(|b| (b.spread, of(b))).collect() };
    let (equal, adjacent) = (curve(&|b| b.equal), curve(&|b| b.adjacent));
    let (scattered, hottest) = (curve(&|b| b.scattered), curve(&|b| b.hottest));
    let finding = |regime: &str, naive, naive_failure, failure, uses| Finding {
        method: "queues",
        regime: regime.to_owned(),
        measure: "work of the busiest SM over the mean",
        naive,
        naive_failure,
        failure,
        uses,
    };
    Ok(Study {
        about: "Strategy migrate on 15 SMs: the work of the busiest over the mean, where 15 means that all others starve, \
                with rays towards an ever smaller part of the scene. Balance is a matter of speed alone: in each round \
                every queue is gone through, no workgroup waits, and rays are conserved.",
        findings: vec![
            finding(
                "rays all over the scene",
                "as many subtrees for each SM",
                equal[0].1,
                adjacent[0].1,
                "neighbours of equal expected work (bvh/partition/owners.rs)",
            ),
            finding(
                "rays at 1 % of the scene: one hot subtree",
                "neighbours to one SM (the default)",
                worst(&adjacent),
                worst(&scattered),
                "--owners scattered, on request: it costs migrations everywhere, see the chart",
            ),
        ],
        charts: vec![
            Chart {
                title: "Balance of SMs against how far rays are spread".to_owned(),
                x: Axis::log("spread", "part of the scene"),
                y: Axis::linear("work of the busiest of 15 SMs over the mean", ""),
                series: vec![
                    Series::new("equal numbers of subtrees", Style::Line, equal),
                    Series::new("adjacent, expected work (default)", Style::Line, adjacent),
                    Series::new("scattered", Style::Line, scattered),
                    Series::new("the hottest subtree alone", Style::Line, hottest),
                ],
                note: format!("{rays} rays a point, subtrees of {policy}"),
            },
            Chart {
                title: "What it costs: migrations against how far rays are spread".to_owned(),
                x: Axis::log("spread", "part of the scene"),
                y: Axis::linear("migrations", "a ray"),
                series: vec![
                    Series::new("adjacent, expected work (default)", Style::Line, curve(&|b| b.migrations[0])),
                    Series::new("scattered", Style::Line, curve(&|b| b.migrations[1])),
                ],
                note: String::new(),
            },
        ],
    })
}

fn balance(bvh: &Bvh, policy: Policy, spread: f64, count: usize) -> Result<Balance> {
    let rays: Vec<Ray> = (0..count as u64).map(|i| ray_outside(bvh, spread as f32, i)).collect();
    // Steps of each SM, and migrations a ray.
    let run = |owners: Owners, sms: u32| -> Result<(Vec<u64>, f64)> {
        let machine = MachineOptions { partition: policy, owners, sms, ..MachineOptions::default() };
        let options = TracerOptions { strategy: Strategy::Migrate, machine, ..TracerOptions::default() };
        let traced = TwinTracer::new(bvh, &options)?.trace(Query::Closest, &rays)?;
        let report = traced.migration.unwrap_or_default();
        let migrations = Totals::of(&traced.counters).migrations as f64 / rays.len() as f64;
        Ok((report.sms.iter().map(|sm| sm.warps.lane_steps).collect(), migrations))
    };
    // With as many SMs as subtrees each has one, and the steps are those of the subtrees.
    let subtrees = Partition::new(bvh, policy, Owners::Adjacent, SMS)?.subtrees.len();
    let single = Partition::new(bvh, policy, Owners::Scattered, subtrees as u32)?;
    let alone = run(Owners::Scattered, subtrees as u32)?.0;
    let mut by_root: Vec<(u32, u64)> =
        single.subtrees.iter().zip(alone).map(|(subtree, steps)| (subtree.root, steps)).collect();
    by_root.sort_unstable();
    let mut equal = vec![0; SMS as usize];
    for (sm, (_, steps)) in equal_numbers(subtrees, SMS as usize).into_iter().zip(&by_root) {
        equal[sm] += steps;
    }
    let total: u64 = by_root.iter().map(|(_, steps)| steps).sum();
    let over_mean = |most: u64| most as f64 * f64::from(SMS) / total.max(1) as f64;
    let busiest = |steps: Vec<u64>| over_mean(steps.into_iter().max().unwrap_or(0));
    let (adjacent, scattered) = (run(Owners::Adjacent, SMS)?, run(Owners::Scattered, SMS)?);
    Ok(Balance {
        spread,
        migrations: [adjacent.1, scattered.1],
        equal: busiest(equal),
        adjacent: busiest(adjacent.0),
        scattered: busiest(scattered.0),
        hottest: over_mean(by_root.iter().map(|(_, steps)| *steps).max().unwrap_or(0)),
    })
}
