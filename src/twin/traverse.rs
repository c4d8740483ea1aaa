//! Twin of `traverse.glsl`: while-while traversal, nearest child first.

use super::box_test::{BoxRay, node_spans};
use super::triangle::{Shear, intersect};
use crate::bvh::Bvh;
use crate::layout::{Hit, Ray, RayCounters};
use crate::shared::*;

/// Runs to the end of the tree or, with `ANY_HIT`, to the first hit.
#[inline(always)]
pub fn traverse<const ANY_HIT: bool>(
    bvh: &Bvh,
    ray: &Ray,
    box_ray: &BoxRay,
    shear: &Shear,
    hit: &mut Hit,
    counters: &mut RayCounters,
) {
    let mut stack = [0u32; STACK_SIZE as usize];
    let mut depth = 0;
    let mut link = 0;
    macro_rules! pop {
        () => {
            if depth == 0 {
                LINK_DONE
            } else {
                depth -= 1;
                stack[depth]
            }
        };
    }
    while link != LINK_DONE {
        while link & LEAF_BIT == 0 {
            counters.node_visits += 1;
            let node = &bvh.nodes[link as usize];
            let spans = node_spans(box_ray, node, ray.t_min, hit.t);
            link = match spans.hits() {
                (true, true) => {
                    let [first, second] = if spans.swapped() { [node.child[1], node.child[0]] } else { node.child };
                    stack[depth] = second;
                    depth += 1;
                    first
                }
                (true, false) => node.child[0],
                (false, true) => node.child[1],
                (false, false) => pop!(),
            };
        }
        if link == LINK_DONE {
            return;
        }
        let first = (link & LEAF_FIRST_MASK) as usize;
        let count = ((link >> LEAF_COUNT_SHIFT) & LEAF_COUNT_MASK) as usize;
        counters.triangle_tests += count as u32;
        for triangle in &bvh.triangles[first..first + count] {
            intersect(ray, box_ray, shear, triangle, hit);
        }
        link = pop!();
        if ANY_HIT && hit.prim != NO_HIT {
            return;
        }
    }
}
