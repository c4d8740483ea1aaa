//! Twin of `traverse.glsl` and `steps.glsl`: while-while traversal, nearest child first.

use glam::Vec3;

use super::box_test::{BoxRay, node_spans};
use super::quantised::decode_node;
use super::triangle::{Shear, intersect};
use crate::bvh::{Bvh, QuantisedBvh};
use crate::layout::{Hit, Node, Ray, RayCounters, Triangle};
use crate::shared::*;

/// Where a traversal stands: the link to follow next and the links put off.
pub struct Cursor {
    /// The link to follow next; [`LINK_DONE`] at the end.
    pub link: u32,
    /// Links put off, the first `depth` of them.
    pub stack: [u32; STACK_SIZE as usize],
    /// How many.
    pub depth: usize,
}

impl Cursor {
    /// At `link`, with nothing put off.
    #[inline(always)]
    pub fn at(link: u32) -> Cursor {
        Cursor { link, stack: [0; STACK_SIZE as usize], depth: 0 }
    }

    /// Puts `link` off.
    #[inline(always)]
    pub fn push(&mut self, link: u32) {
        self.stack[self.depth] = link;
        self.depth += 1;
    }

    /// The link put off last, or [`LINK_DONE`].
    #[inline(always)]
    pub fn pop<S: StepSink>(&mut self, counters: &mut RayCounters) -> u32 {
        if self.depth == 0 {
            return LINK_DONE;
        }
        self.depth -= 1;
        counters.stack_operations += u32::from(S::COUNTS);
        self.stack[self.depth]
    }
}

/// Takes the words of a step trace: a node's index, with [`STEP_PUSHED`] if one of its children was put off,
/// or a leaf's link.
pub trait StepSink: Default + Send + Sync {
    /// Whether counters are wanted: without them the twin is as fast as the kernels without.
    const COUNTS: bool = true;
    /// The ray's next step.
    fn step(&mut self, word: u32);
    /// Steps that follow those so far.
    fn append(&mut self, more: Self);
}

/// Neither steps nor counters are wanted.
#[derive(Default)]
pub struct Uncounted;

impl StepSink for Uncounted {
    const COUNTS: bool = false;

    #[inline(always)]
    fn step(&mut self, _word: u32) {}

    #[inline(always)]
    fn append(&mut self, _more: Uncounted) {}
}

/// Counters without steps.
impl StepSink for () {
    #[inline(always)]
    fn step(&mut self, _word: u32) {}

    #[inline(always)]
    fn append(&mut self, _more: ()) {}
}

impl StepSink for Vec<u32> {
    #[inline(always)]
    fn step(&mut self, word: u32) {
        self.push(word);
    }

    fn append(&mut self, more: Vec<u32>) {
        self.extend(more);
    }
}

/// What is traversed: nodes in one format or another, and triangles.
pub trait Tree: Sync {
    /// The node at `index`.
    fn node(&self, index: u32) -> Node;
    /// Triangles in traversal order.
    fn triangles(&self) -> &[Triangle];
    /// Low and high corner of the scene.
    fn bounds(&self) -> (Vec3, Vec3);
}

impl Tree for Bvh {
    #[inline(always)]
    fn node(&self, index: u32) -> Node {
        self.nodes[index as usize]
    }

    #[inline(always)]
    fn triangles(&self) -> &[Triangle] {
        &self.triangles
    }

    #[inline(always)]
    fn bounds(&self) -> (Vec3, Vec3) {
        self.bounds
    }
}

impl Tree for QuantisedBvh<'_> {
    #[inline(always)]
    fn node(&self, index: u32) -> Node {
        decode_node(index, &self.nodes[index as usize])
    }

    #[inline(always)]
    fn triangles(&self) -> &[Triangle] {
        &self.bvh.triangles
    }

    #[inline(always)]
    fn bounds(&self) -> (Vec3, Vec3) {
        self.bvh.bounds
    }
}

/// A ray, prepared for tests.
pub struct PreparedRay<'a> {
    /// The ray.
    pub ray: &'a Ray,
    /// For boxes.
    pub box_ray: BoxRay,
    /// For triangles.
    pub shear: Shear,
}

/// Whether a link is a node's.
#[inline(always)]
pub fn is_node(link: u32) -> bool {
    link & LEAF_BIT == 0
}

/// Links of the nearest child that the ray meets before `t`, and of the other, or [`LINK_DONE`].
#[inline(always)]
pub fn met_children(node: &Node, ray: &PreparedRay, t: f32) -> (u32, u32) {
    let spans = node_spans(&ray.box_ray, node, ray.ray.t_min, t);
    match spans.hits() {
        (true, true) if spans.swapped() => (node.child[1], node.child[0]),
        (true, true) => (node.child[0], node.child[1]),
        (true, false) => (node.child[0], LINK_DONE),
        (false, true) => (node.child[1], LINK_DONE),
        (false, false) => (LINK_DONE, LINK_DONE),
    }
}

/// Runs until the tree is done, a hit is found (`ANY_HIT`) or `steps` reaches `limit`; `cursor.link` tells:
/// [`LINK_DONE`], or the node where to go on.
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "the kernel's own")]
pub fn traverse<const ANY_HIT: bool, S: StepSink>(
    tree: &impl Tree,
    ray: &PreparedRay,
    cursor: &mut Cursor,
    hit: &mut Hit,
    counters: &mut RayCounters,
    sink: &mut S,
    (steps, limit): (&mut u32, u32),
) {
    while cursor.link != LINK_DONE && !(*steps >= limit && is_node(cursor.link)) {
        while is_node(cursor.link) && *steps < limit {
            *steps += 1;
            counters.node_visits += u32::from(S::COUNTS);
            let (near, far) = met_children(&tree.node(cursor.link), ray, hit.t);
            if far != LINK_DONE {
                sink.step(cursor.link | STEP_PUSHED);
                counters.stack_operations += u32::from(S::COUNTS);
                cursor.push(far);
            } else {
                sink.step(cursor.link);
            }
            cursor.link = if near != LINK_DONE { near } else { cursor.pop::<S>(counters) };
        }
        if is_node(cursor.link) || cursor.link == LINK_DONE {
            continue;
        }
        sink.step(cursor.link);
        let first = (cursor.link & LEAF_FIRST_MASK) as usize;
        let count = ((cursor.link >> LEAF_COUNT_SHIFT) & LEAF_COUNT_MASK) as usize;
        if S::COUNTS {
            counters.leaf_visits += 1;
            counters.triangle_tests += count as u32;
        }
        *steps += (count as u32).max(1);
        for triangle in &tree.triangles()[first..first + count] {
            intersect(ray.ray, &ray.box_ray, &ray.shear, triangle, hit);
        }
        cursor.link = if ANY_HIT && hit.prim != NO_HIT { LINK_DONE } else { cursor.pop::<S>(counters) };
    }
}
