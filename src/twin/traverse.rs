//! Twin of `traverse.glsl`: while-while traversal, nearest child first.

use super::box_test::{BoxRay, node_spans};
use super::triangle::{Shear, intersect};
use crate::bvh::Bvh;
use crate::layout::{Hit, Ray, RayCounters};
use crate::shared::*;

/// Sees each visit of a traversal. The no-op version, `()`, compiles to nothing.
pub trait Observer {
    /// Node `index` was read; `pushed` if one of its children went on the stack.
    fn node(&mut self, index: u32, pushed: bool);
    /// The leaf behind `link`, as in [`crate::layout::Node::child`], was entered.
    fn leaf(&mut self, link: u32);
}

impl Observer for () {
    #[inline(always)]
    fn node(&mut self, _: u32, _: bool) {}
    #[inline(always)]
    fn leaf(&mut self, _: u32) {}
}

/// Runs to the end of the tree or, with `ANY_HIT`, to the first hit.
#[inline(always)]
pub fn traverse<const ANY_HIT: bool>(
    bvh: &Bvh,
    ray: &Ray,
    box_ray: &BoxRay,
    shear: &Shear,
    hit: &mut Hit,
    counters: &mut RayCounters,
    observer: &mut impl Observer,
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
            let hits = spans.hits();
            observer.node(link, hits == (true, true));
            link = match hits {
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
        observer.leaf(link);
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
