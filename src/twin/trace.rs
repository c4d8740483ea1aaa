//! Twin of `trace.glsl`: a ray's way through the whole tree. Strategies `direct` and `persistent` differ in
//! who takes which ray when, which a CPU decides for itself.

use rayon::prelude::*;

use super::box_test::box_ray;
use super::traverse::{Cursor, PreparedRay, StepSink, Tree, Uncounted, traverse};
use super::triangle::shear_of;
use crate::layout::{Hit, Ray, RayCounters};
use crate::shared::NO_HIT;

/// Rays of one task: large enough to hide the cost of a task, small enough to balance the load.
const CHUNK: usize = 1024;

/// Nearest hit of each ray, and what each did in the tree.
pub fn trace_closest(tree: &impl Tree, rays: &[Ray]) -> (Vec<Hit>, Vec<RayCounters>) {
    trace::<false>(tree, rays)
}

/// Whether each ray meets anything: `prim` is 0 if it does, [`NO_HIT`] if not.
pub fn trace_any(tree: &impl Tree, rays: &[Ray]) -> (Vec<Hit>, Vec<RayCounters>) {
    trace::<true>(tree, rays)
}

/// Nearest hit of each ray, and nothing else.
pub fn hits(tree: &impl Tree, rays: &[Ray]) -> Vec<Hit> {
    let mut hits: Vec<Hit> = vec![bytemuck::Zeroable::zeroed(); rays.len()];
    rays.par_chunks(CHUNK).zip(hits.par_chunks_mut(CHUNK)).for_each(|(rays, hits)| {
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = trace_ray::<false, Uncounted>(tree, ray, &mut RayCounters::default(), &mut Uncounted);
        }
    });
    hits
}

fn trace<const ANY_HIT: bool>(tree: &impl Tree, rays: &[Ray]) -> (Vec<Hit>, Vec<RayCounters>) {
    let mut hits: Vec<Hit> = vec![bytemuck::Zeroable::zeroed(); rays.len()];
    let mut counters: Vec<RayCounters> = vec![bytemuck::Zeroable::zeroed(); rays.len()];
    rays.par_chunks(CHUNK).zip(hits.par_chunks_mut(CHUNK)).zip(counters.par_chunks_mut(CHUNK)).for_each(
        |((rays, hits), counters)| {
            for ((ray, hit), counters) in rays.iter().zip(hits).zip(counters) {
                *hit = trace_ray::<ANY_HIT, ()>(tree, ray, counters, &mut ());
            }
        },
    );
    (hits, counters)
}

/// The ray's way: its hit, what it did, and each of its steps.
#[inline(always)]
pub fn trace_ray<const ANY_HIT: bool, S: StepSink>(
    tree: &impl Tree,
    ray: &Ray,
    counters: &mut RayCounters,
    sink: &mut S,
) -> Hit {
    let mut hit = missed(ray);
    if ray.is_live() {
        let prepared = prepare(tree, ray);
        traverse::<ANY_HIT, S>(tree, &prepared, &mut Cursor::at(0), &mut hit, counters, sink, (&mut 0, u32::MAX));
    }
    finished::<ANY_HIT>(hit)
}

/// A ray prepared for the boxes and triangles of a scene.
#[inline(always)]
pub fn prepare<'a>(tree: &impl Tree, ray: &'a Ray) -> PreparedRay<'a> {
    let (low, high) = tree.bounds();
    let box_ray = box_ray(ray, low, high);
    PreparedRay { ray, box_ray, shear: shear_of(ray.direction) }
}

/// The hit of a ray that has met nothing so far.
#[inline(always)]
pub fn missed(ray: &Ray) -> Hit {
    Hit { t: ray.t_max, prim: NO_HIT, u: 0.0, v: 0.0 }
}

/// Which triangle an any-hit ray meets depends on the order of visits; that it meets one does not.
#[inline(always)]
pub fn finished<const ANY_HIT: bool>(hit: Hit) -> Hit {
    if ANY_HIT && hit.is_hit() { Hit { t: 0.0, prim: 0, u: 0.0, v: 0.0 } } else { hit }
}
