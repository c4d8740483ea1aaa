//! Stack and trail: trees that are chains, as deep as there are triangles.

use glam::Vec3;

use super::naive::short_stack;
use super::shapes::{Positions, ray, tree};
use super::{Effort, Finding, Study, rate, worst};
use crate::Result;
use crate::bvh::Bvh;
use crate::bvh::statistics::Statistics;
use crate::layout::{Hit, Ray};
use crate::report::chart::{Axis, Chart, Series, Style};
use crate::scene::procedural::random::Random;
use crate::shared::STACK_SIZE;
use crate::twin::trace::hits;
use crate::twin::trail::{Trail, cursor_of_trail, other_child, trail_of_stack};
use crate::twin::traverse::Cursor;

/// Stacks that are common in kernels.
const ENTRIES: [usize; 3] = [16, 24, 32];

pub fn study(effort: Effort) -> Result<Study> {
    let rays = effort.of(1_000, 20_000);
    let cases: Vec<Case> = (8..=96).step_by(8).map(|triangles| Case::new(triangles, rays)).collect::<Result<_>>()?;
    let curve = |of: &dyn Fn(&Case) -> f64| -> Vec<(f64, f64)> { cases.iter().map(|c| (c.triangles, of(c))).collect() };
    let short = |k: usize| curve(&|case: &Case| case.short[k]);
    let trails = [curve(&|case| case.trails[0]), curve(&|case| case.trails[1])];
    let own = curve(&|case| case.own);
    let mut series: Vec<Series> =
        (0..3).map(|k| Series::new(format!("stack of {}", ENTRIES[k]), Style::Line, short(k))).collect();
    series.push(Series::new("this program", Style::Line, own.clone()));
    Ok(Study {
        about: "Triangles of which each is twice as large as the one before it, one behind the other: the builder's tree is \
                a chain, and a ray through all boxes puts one leaf off at each level.",
        findings: vec![
            Finding {
                method: "stack",
                regime: "chains of 8 to 96 triangles".to_owned(),
                measure: "wrong hits, part of the rays",
                naive: "a stack of 32 entries that forgets what does not fit",
                naive_failure: worst(&short(2)),
                failure: worst(&own),
                uses: "64 entries, and a builder that lays out no deeper tree (bvh/lay_out.rs)",
            },
            Finding {
                method: "trail",
                regime: "nodes of such chains, everything above pending".to_owned(),
                measure: "stacks that a trail does not give back, part of the nodes",
                naive: "a trail of 32 bits",
                naive_failure: worst(&trails[0]),
                failure: worst(&trails[1]),
                uses: "a bit a level in 64 bits (twin/trail.rs)",
            },
        ],
        charts: vec![
            Chart {
                title: "Wrong hits against the length of a chain".to_owned(),
                x: Axis::linear("triangles", ""),
                y: Axis::linear("wrong hits", "part of all rays"),
                series,
                note: format!("{rays} rays a point; the nearest hit is found by testing every triangle"),
            },
            Chart {
                title: "Depth of the tree against the length of a chain".to_owned(),
                x: Axis::linear("triangles", ""),
                y: Axis::linear("depth", "levels"),
                series: vec![
                    Series::new("as laid out", Style::Line, curve(&|case| case.depth)),
                    Series::new(
                        "entries of the stack, bits of a trail",
                        Style::Line,
                        curve(&|_| f64::from(STACK_SIZE)),
                    ),
                ],
                note: "A tree that would be deeper is halved below a level that leaves room for it.".to_owned(),
            },
        ],
    })
}

struct Case {
    triangles: f64,
    depth: f64,
    /// Wrong hits with each of [`ENTRIES`].
    short: [f64; 3],
    /// Wrong hits of this program.
    own: f64,
    /// Stacks lost by a trail of 32 bits and of 64.
    trails: [f64; 2],
}

impl Case {
    fn new(triangles: i32, count: usize) -> Result<Case> {
        let positions = chain(triangles);
        let bvh = tree(&positions)?;
        let ray_of = |i: u64| along_the_chain(&positions, i);
        let every = |i: u64| nearest(&bvh, &ray_of(i));
        let wrong = |hit: Hit, i: u64| bytemuck::bytes_of(&hit) != bytemuck::bytes_of(&every(i));
        let own = hits(&bvh, &(0..count as u64).map(ray_of).collect::<Vec<Ray>>());
        Ok(Case {
            triangles: f64::from(triangles),
            depth: Statistics::of(&bvh).depth as f64,
            short: ENTRIES.map(|entries| rate(count, |i| wrong(short_stack(&bvh, &ray_of(i), entries), i))),
            own: rate(count, |i| wrong(own[i as usize], i)),
            trails: [u64::from(u32::MAX), u64::MAX]
                .map(|bits| rate(bvh.nodes.len(), |node| !survives(&bvh, node as u32, bits))),
        })
    }
}

/// Thin triangles across the z axis from 2^-36 on: of 96, the last is just below the largest coordinate allowed. Each
/// box holds the rays, each triangle is met by few of them.
fn chain(triangles: i32) -> Positions {
    let one = |i: i32| {
        let size = 2f32.powi(i - 36);
        let end = Random::stream(9, i as u64).between(0.3, 1.1);
        [(-1.0, -1.0), (1.0, end), (1.0, end + 0.2)].map(|(x, y)| Vec3::new(x, y, 1.0) * size)
    };
    (0..triangles).map(one).collect()
}

/// From before the chain towards a point of its first triangle's box, and so of all boxes; the triangles' middles are
/// at y of -0.35 to 0.15.
fn along_the_chain(positions: &Positions, index: u64) -> Ray {
    let random = &mut Random::stream(7, index);
    let size = positions[0][0].z;
    let target = Vec3::new(random.between(-0.1, 0.1), random.between(-0.35, 0.15), 1.0) * size;
    ray(Vec3::ZERO, target)
}

/// The nearest hit of all triangles.
fn nearest(bvh: &Bvh, ray: &Ray) -> Hit {
    let prepared = crate::twin::trace::prepare(bvh, ray);
    let mut hit = crate::twin::trace::missed(ray);
    for triangle in &bvh.triangles {
        crate::twin::triangle::intersect(ray, &prepared.box_ray, &prepared.shear, triangle, &mut hit);
    }
    hit
}

/// Whether the stack of a ray at `node`, all above pending, comes back from the `bits` of its trail.
fn survives(bvh: &Bvh, node: u32, bits: u64) -> bool {
    let mut cursor = Cursor::at(node);
    let (mut at, mut pending) = (node, Vec::new());
    while at != 0 {
        let parent = bvh.nodes[at as usize].parent;
        pending.push(other_child(&bvh.nodes[parent as usize], at));
        at = parent;
    }
    for link in pending.into_iter().rev() {
        cursor.stack[cursor.depth] = link;
        cursor.depth += 1;
    }
    let trail = trail_of_stack(&bvh.nodes, (0, 0), &cursor, Trail::default());
    let back = cursor_of_trail(&bvh.nodes, (0, 0), node, Trail(trail.0 & bits));
    (back.depth, back.stack) == (cursor.depth, cursor.stack)
}
