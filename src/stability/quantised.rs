//! Quantised nodes: what larger boxes cost, and what boxes rounded to the nearest step would lose.

use super::naive::nearest_steps;
use super::shapes::ray_outside;
use super::{Effort, Finding, Study, worst};
use crate::Result;
use crate::bvh::statistics::Statistics;
use crate::bvh::{Bvh, QuantisedBvh};
use crate::layout::{Hit, Ray};
use crate::report::chart::{Axis, Chart, Series, Style};
use crate::scene::procedural;
use crate::shared::{LEAF_BIT, STEP_PUSHED};
use crate::trace::Query;
use crate::trace::steps::record_steps;
use crate::twin::trace::hits;
use crate::twin::traverse::Tree;

const SCENES: [&str; 3] = ["room", "forest", "blob"];

/// Node visits by level that are too few to give a ratio.
const FEW: u64 = 1000;

pub fn study(effort: Effort) -> Result<Study> {
    let rays = effort.of(5_000, 30_000);
    let sizes: &[usize] = if effort == Effort::Quick { &[1_000, 8_000] } else { &[1_000, 8_000, 64_000, 512_000] };
    let (mut growth, mut levels, mut lost, mut wrong) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for name in SCENES {
        let cases: Vec<Case> = sizes.iter().map(|&size| Case::new(name, size, rays)).collect::<Result<_>>()?;
        let curve = |of: &dyn Fn(&Case) -> f64| -> Vec<(f64, f64)> { cases.iter().map(|c| (c.depth, of(c))).collect() };
        growth.push(Series::new(name, Style::Line, curve(&|c| c.growth)));
        lost.extend(curve(&|c| c.lost));
        wrong.extend(curve(&|c| c.wrong));
        let last = cases.into_iter().next_back().map(|case| case.by_level).unwrap_or_default();
        levels.push(Series::new(name, Style::Line, last));
    }
    let largest = growth.iter().flat_map(|series| &series.points).map(|point| point.y).fold(0.0, f64::max);
    let finding = |regime: String, measure, naive, naive_failure, failure| Finding {
        method: "quantised nodes",
        regime,
        measure,
        naive,
        naive_failure,
        failure,
        uses: "planes moved outwards on a grid of each node's own (bvh/quantise.rs)",
    };
    let deepest = growth.iter().flat_map(|series| &series.points).map(|point| point.x).fold(0.0, f64::max);
    Ok(Study {
        about: "Node visits with boxes in 8 bits a plane over those with floats, for procedural scenes of 1,000 triangles \
                and more; hits with planes rounded to the nearest step.",
        findings: vec![
            finding(
                format!("scenes up to {deepest} levels deep"),
                "wrong hits, part of the rays",
                "planes rounded to the nearest step",
                worst(&lost),
                worst(&wrong),
            ),
            finding(
                format!("scenes up to {deepest} levels deep"),
                "node visits more than needed, part of all",
                "full nodes, at twice the bytes",
                0.0,
                largest - 1.0,
            ),
        ],
        charts: vec![
            Chart {
                title: "Growth of node visits against the depth of the tree".to_owned(),
                x: Axis::linear("depth", "levels"),
                y: Axis::linear("visits, quantised over full", ""),
                series: growth,
                note: format!("{} triangles, {rays} rays; 32 bytes a node instead of 64", list(sizes)),
            },
            Chart {
                title: "Growth of node visits by level in the tree".to_owned(),
                x: Axis::linear("level", ""),
                y: Axis::linear("visits, quantised over full", ""),
                series: levels,
                note: format!("{} triangles; levels with {FEW} visits or more", sizes[sizes.len() - 1]),
            },
        ],
    })
}

fn list(sizes: &[usize]) -> String {
    sizes.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
}

/// A scene with both formats of nodes.
struct Case {
    depth: f64,
    growth: f64,
    by_level: Vec<(f64, f64)>,
    /// Part of the hits that differ with planes at the nearest step, and with planes moved outwards.
    lost: f64,
    wrong: f64,
}

impl Case {
    fn new(name: &str, triangles: usize, rays: usize) -> Result<Case> {
        let bvh = Bvh::build(&procedural::build(name, triangles, 1)?.positions, Default::default())?;
        let rays: Vec<Ray> = (0..rays as u64).map(|i| ray_outside(&bvh, 0.4, i)).collect();
        let quantised = QuantisedBvh::new(&bvh);
        let (exact, full) = visits(&bvh, &bvh, &rays);
        let (found, more) = visits(&quantised, &bvh, &rays);
        let differing = |other: &[Hit]| {
            let pairs = exact.iter().zip(other);
            pairs.filter(|(a, b)| bytemuck::bytes_of(*a) != bytemuck::bytes_of(*b)).count() as f64 / rays.len() as f64
        };
        let ratio = |level: usize| (level as f64, more[level] as f64 / full[level] as f64);
        Ok(Case {
            depth: Statistics::of(&bvh).depth as f64,
            growth: more.iter().sum::<u64>() as f64 / full.iter().sum::<u64>() as f64,
            by_level: (0..full.len()).filter(|&level| full[level] >= FEW).map(ratio).collect(),
            lost: differing(&hits(&nearest_steps(&bvh), &rays)),
            wrong: differing(&found),
        })
    }
}

/// Hits, and node visits by level, with levels from the full tree.
fn visits(tree: &impl Tree, bvh: &Bvh, rays: &[Ray]) -> (Vec<Hit>, Vec<u64>) {
    let (hits, trace) = record_steps(tree, rays, Query::Closest);
    let mut visits = vec![0; crate::shared::STACK_SIZE as usize];
    for step in trace.steps.iter().filter(|&step| step & LEAF_BIT == 0) {
        visits[bvh.nodes[(step & !STEP_PUSHED) as usize].level as usize] += 1;
    }
    (hits, visits)
}
