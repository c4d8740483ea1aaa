//! Step traces: where each ray went in the tree.

use rayon::prelude::*;

use crate::layout::{Hit, Ray, RayCounters};
use crate::trace::Query;
use crate::twin::trace::trace_ray;
use crate::twin::traverse::Tree;

/// Rays of one task.
const CHUNK: usize = 1024;

/// The visits of each ray, in order. A step is one word:
/// - a node: its index, with [`crate::shared::STEP_PUSHED`] if one of its children went on the stack;
/// - a leaf: its link as in [`crate::layout::Node::child`] (`LEAF_BIT`, triangle count, first triangle).
///
/// Pops are implied: a visit that is no child of the one before it was popped, because what is popped was
/// pushed at an earlier node and each node and leaf has one parent.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StepTrace {
    /// Ray `i` took the steps `starts[i]..starts[i + 1]`; one entry more than rays.
    pub starts: Vec<u64>,
    /// Steps of all rays.
    pub steps: Vec<u32>,
}

impl StepTrace {
    /// Number of rays.
    pub fn rays(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Steps of one ray.
    ///
    /// # Panics
    /// If there is no ray `ray`.
    pub fn of(&self, ray: usize) -> &[u32] {
        &self.steps[self.starts[ray] as usize..self.starts[ray + 1] as usize]
    }

    /// Adds `rays` of `other` after those here.
    ///
    /// # Panics
    /// If `other` has fewer.
    pub fn append(&mut self, other: &StepTrace, rays: std::ops::Range<usize>) {
        let (base, first) = (self.steps.len() as u64, other.starts[rays.start]);
        let ends = &other.starts[rays.start + 1..=rays.end];
        self.starts.extend(ends.iter().map(|end| base + end - first));
        self.steps.extend(&other.steps[first as usize..other.starts[rays.end] as usize]);
    }

    /// Records each ray by `trace`, which appends the ray's steps; in parallel, in the order of `rays`.
    pub fn record<H: Send>(rays: &[Ray], trace: impl Fn(&Ray, &mut Vec<u32>) -> H + Sync) -> (Vec<H>, StepTrace) {
        let part = |rays: &[Ray]| {
            let (mut ends, mut steps) = (Vec::with_capacity(rays.len()), Vec::new());
            let hits: Vec<H> = rays
                .iter()
                .map(|ray| {
                    let hit = trace(ray, &mut steps);
                    ends.push(steps.len() as u64);
                    hit
                })
                .collect();
            (hits, ends, steps)
        };
        StepTrace::joined(rays.par_chunks(CHUNK).map(part).collect())
    }

    /// Records each `size` rays together by `trace`, which returns what it found and the steps of each; in parallel,
    /// in the order of `rays`.
    pub fn record_groups<H: Send>(
        rays: &[Ray],
        size: usize,
        trace: impl Fn(&[Ray]) -> Vec<(H, Vec<u32>)> + Sync,
    ) -> (Vec<H>, StepTrace) {
        let group = |rays: &[Ray]| {
            let (mut hits, mut ends, mut steps) = (Vec::new(), Vec::new(), Vec::new());
            for (hit, more) in trace(rays) {
                hits.push(hit);
                steps.extend(more);
                ends.push(steps.len() as u64);
            }
            (hits, ends, steps)
        };
        StepTrace::joined(rays.par_chunks(size).map(group).collect())
    }

    /// Parts one behind the other: what was found, where each ray's steps end within the part, and the steps.
    fn joined<H>(parts: Vec<(Vec<H>, Vec<u64>, Vec<u32>)>) -> (Vec<H>, StepTrace) {
        let (rays, count) =
            parts.iter().fold((0, 0), |(rays, count), (hits, _, steps)| (rays + hits.len(), count + steps.len()));
        let (mut hits, mut starts, mut steps) =
            (Vec::with_capacity(rays), Vec::with_capacity(rays + 1), vec![0; count]);
        starts.push(0);
        let (mut rest, mut base) = (&mut steps[..], 0);
        let mut copies = Vec::with_capacity(parts.len());
        for (part, ends, steps) in parts {
            let (place, after) = rest.split_at_mut(steps.len());
            rest = after;
            starts.extend(ends.into_iter().map(|end| base + end));
            base += steps.len() as u64;
            hits.extend(part);
            copies.push((place, steps));
        }
        copies.into_par_iter().for_each(|(place, steps): (&mut [u32], Vec<u32>)| place.copy_from_slice(&steps));
        (hits, StepTrace { starts, steps })
    }
}

/// Steps of the twin's traversal, and the hits it found. All strategies take the same steps.
pub fn record_steps(tree: &impl Tree, rays: &[Ray], query: Query) -> (Vec<Hit>, StepTrace) {
    StepTrace::record(rays, |ray, steps| hit_of(tree, ray, query, steps))
}

/// The steps alone.
pub fn steps_of(tree: &impl Tree, rays: &[Ray], query: Query) -> StepTrace {
    let record = |ray: &Ray, steps: &mut Vec<u32>| {
        hit_of(tree, ray, query, steps);
    };
    StepTrace::record(rays, record).1
}

#[inline(always)]
fn hit_of(tree: &impl Tree, ray: &Ray, query: Query, steps: &mut Vec<u32>) -> Hit {
    let mut counters = RayCounters::default();
    match query {
        Query::Closest => trace_ray::<false, _>(tree, ray, &mut counters, steps),
        Query::Any => trace_ray::<true, _>(tree, ray, &mut counters, steps),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::Bvh;
    use crate::scene::procedural;
    use crate::shared::{LEAF_BIT, LEAF_COUNT_MASK, LEAF_COUNT_SHIFT, STEP_PUSHED};
    use crate::twin::trace::{trace_any, trace_closest};
    use glam::Vec3;

    fn room() -> (Bvh, Vec<Ray>) {
        let scene = procedural::build("room", 3000, 1).unwrap();
        let bvh = Bvh::build(&scene.positions, Default::default()).unwrap();
        let (low, high) = bvh.bounds;
        let rays = (0..3000u32)
            .map(|i| {
                let fraction = |k: u32| (i.wrapping_mul(k) >> 8 & 0xffff) as f32 / 65536.0;
                let origin = low + (high - low) * Vec3::new(fraction(2654435761), fraction(40503), fraction(97));
                let direction = Vec3::new(fraction(31) - 0.5, fraction(69069) - 0.5, fraction(1103515245) - 0.4);
                let direction = direction.normalize();
                Ray { origin: origin.into(), t_min: 0.0, direction: direction.into(), t_max: 1.0e30 }
            })
            .collect();
        (bvh, rays)
    }

    /// Follows `steps` with a stack; an error names the first step that traversal could not have taken.
    fn replay(bvh: &Bvh, steps: &[u32]) -> Result<usize, String> {
        let (mut stack, mut previous): (Vec<u32>, Option<u32>) = (Vec::new(), None);
        for (at, &step) in steps.iter().enumerate() {
            let link = if step & LEAF_BIT == 0 { step & !STEP_PUSHED } else { step };
            let parent = previous.filter(|p| p & LEAF_BIT == 0).map(|p| bvh.nodes[(p & !STEP_PUSHED) as usize].child);
            match (parent, previous) {
                (_, None) if link == 0 => {}
                (Some([a, b]), Some(p)) if link == a || link == b => {
                    if p & STEP_PUSHED != 0 {
                        stack.push(if link == a { b } else { a });
                    }
                }
                (_, Some(p)) if p & LEAF_BIT != 0 || p & STEP_PUSHED == 0 => {
                    if stack.pop() != Some(link) {
                        return Err(format!("step {at}: {link:#x} was not on top of the stack"));
                    }
                }
                _ => return Err(format!("step {at}: {link:#x} neither child nor popped")),
            }
            previous = Some(step);
        }
        Ok(stack.len())
    }

    #[test]
    fn steps_replay_with_pops_implied_and_end_with_an_empty_stack() {
        let (bvh, rays) = room();
        let (_, trace) = record_steps(&bvh, &rays, Query::Closest);
        for ray in 0..rays.len() {
            assert_eq!(replay(&bvh, trace.of(ray)), Ok(0), "ray {ray}");
        }
    }

    #[test]
    fn steps_count_what_the_counters_count_and_change_no_hit() {
        let (bvh, rays) = room();
        for (query, (hits, counters)) in
            [(Query::Closest, trace_closest(&bvh, &rays)), (Query::Any, trace_any(&bvh, &rays))]
        {
            let (observed, trace) = record_steps(&bvh, &rays, query);
            assert!(hits == observed);
            assert_eq!(trace.rays(), rays.len());
            for (ray, counters) in counters.iter().enumerate() {
                let (leaves, nodes): (Vec<u32>, Vec<u32>) = trace.of(ray).iter().partition(|&s| s & LEAF_BIT != 0);
                let tests: u32 = leaves.iter().map(|link| link >> LEAF_COUNT_SHIFT & LEAF_COUNT_MASK).sum();
                assert_eq!((nodes.len() as u32, tests), (counters.node_visits, counters.triangle_tests));
            }
        }
    }

    #[test]
    fn no_rays_leave_an_empty_trace() {
        let (bvh, _) = room();
        assert_eq!(record_steps(&bvh, &[], Query::Closest).1, StepTrace { starts: vec![0], steps: vec![] });
    }
}
