//! Twin of `top_tree.glsl`: the walk of the top tree from one subtree to the next.

use super::trail::{Trail, other_child};
use super::traverse::{PreparedRay, StepSink, is_node, met_children};
use crate::bvh::Partition;
use crate::layout::RayCounters;
use crate::shared::{LINK_DONE, STEP_PUSHED};

/// A link of the top tree and where it is from.
pub struct Stand {
    /// The link to follow; [`LINK_DONE`] if it is done.
    pub link: u32,
    /// The top node whose child it is.
    pub above: u32,
    /// The child of that node that is done.
    pub came_from: u32,
}

/// Follows a link until it is a subtree's, and returns it; [`LINK_DONE`] when nothing is pending any more.
#[inline(always)]
pub fn next_subtree(
    partition: &Partition,
    ray: &PreparedRay,
    t: f32,
    Stand { mut link, mut above, mut came_from }: Stand,
    (trail, counters, sink, steps): (&mut Trail, &mut RayCounters, &mut impl StepSink, &mut u32),
) -> u32 {
    let top = &partition.top;
    while if link == LINK_DONE { !trail.is_empty() } else { is_node(link) } {
        if link == LINK_DONE {
            let level = trail.deepest();
            while top[above as usize].level > level {
                came_from = above;
                above = top[above as usize].parent;
                *steps += 1;
                counters.climbs += 1;
            }
            *trail = trail.above(level);
            link = other_child(&top[above as usize], came_from);
            counters.stack_operations += 1;
            counters.top_stack_operations += 1;
        }
        if is_node(link) {
            *steps += 1;
            above = link;
            counters.node_visits += 1;
            counters.top_visits += 1;
            let node = &top[link as usize];
            let (near, far) = met_children(node, ray, t);
            let place = partition.top_places[link as usize];
            if far != LINK_DONE {
                trail.put(node.level);
                counters.stack_operations += 1;
                counters.top_stack_operations += 1;
                sink.step(place | STEP_PUSHED);
            } else {
                sink.step(place);
            }
            link = near;
        }
    }
    link
}
