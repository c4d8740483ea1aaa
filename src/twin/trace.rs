//! Twin of `trace.glsl` (`trace_closest.comp`, `trace_any.comp`).

use rayon::prelude::*;

use super::box_test::box_ray;
use super::traverse::{Observer, traverse};
use super::triangle::shear_of;
use crate::bvh::Bvh;
use crate::layout::{Hit, Ray, RayCounters};
use crate::shared::NO_HIT;

/// Rays of one task: large enough to hide the cost of a task, small enough to balance the load.
const CHUNK: usize = 1024;

/// Nearest hit of each ray, and what each did in the tree.
pub fn trace_closest(bvh: &Bvh, rays: &[Ray]) -> (Vec<Hit>, Vec<RayCounters>) {
    trace::<false>(bvh, rays)
}

/// Whether each ray meets anything: `prim` is 0 if it does, [`NO_HIT`] if not.
pub fn trace_any(bvh: &Bvh, rays: &[Ray]) -> (Vec<Hit>, Vec<RayCounters>) {
    trace::<true>(bvh, rays)
}

fn trace<const ANY_HIT: bool>(bvh: &Bvh, rays: &[Ray]) -> (Vec<Hit>, Vec<RayCounters>) {
    let mut hits: Vec<Hit> = vec![bytemuck::Zeroable::zeroed(); rays.len()];
    let mut counters: Vec<RayCounters> = vec![bytemuck::Zeroable::zeroed(); rays.len()];
    rays.par_chunks(CHUNK).zip(hits.par_chunks_mut(CHUNK)).zip(counters.par_chunks_mut(CHUNK)).for_each(
        |((rays, hits), counters)| {
            for ((ray, hit), counters) in rays.iter().zip(hits).zip(counters) {
                *hit = trace_ray::<ANY_HIT>(bvh, ray, counters, &mut ());
            }
        },
    );
    (hits, counters)
}

/// Hit of one ray, nearest or with `ANY_HIT` any; `observer` sees its way through the tree.
#[inline(always)]
pub fn trace_ray<const ANY_HIT: bool>(
    bvh: &Bvh,
    ray: &Ray,
    counters: &mut RayCounters,
    observer: &mut impl Observer,
) -> Hit {
    let mut hit = Hit { t: ray.t_max, prim: NO_HIT, u: 0.0, v: 0.0 };
    if ray.t_max >= ray.t_min {
        let box_ray = box_ray(ray, bvh.bounds.0, bvh.bounds.1);
        traverse::<ANY_HIT>(bvh, ray, &box_ray, &shear_of(ray.direction), &mut hit, counters, observer);
    }
    if ANY_HIT && hit.prim != NO_HIT {
        hit = Hit { t: 0.0, prim: 0, u: 0.0, v: 0.0 };
    }
    hit
}
