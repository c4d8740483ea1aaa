//! Lays a tree out for traversal.

use std::ops::Range;

use glam::Vec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;

use super::build::{Bvh, EMPTY_LEAF, NOWHERE, node};
use super::coincident::BuildPrimitives;
use crate::layout::{Node, Triangle};
use crate::shared::{LEAF_BIT, LEAF_COUNT_SHIFT, LEAF_FIRST_MASK, MAX_LEAF_TRIANGLES, STACK_SIZE};

/// Levels in which any number of triangles that the layout can hold, 2^27, are halved down to leaves of 8.
const HALVINGS: usize = 24;

/// Level from which a tree too deep for the stack is laid out by halves.
const DEEPEST_LEVEL: usize = STACK_SIZE as usize - HALVINGS;

/// Depth-first: a node, then all below its first child, then all below its second.
pub fn lay_out(tree: &Bvh2, primitives: &BuildPrimitives, positions: &[[Vec3; 3]]) -> Bvh {
    let deepest = if primitives.has_groups() { DEEPEST_LEVEL } else { STACK_SIZE as usize };
    let mut layout = Layout {
        tree,
        primitives,
        positions,
        halved_from: if depth(tree) > deepest { DEEPEST_LEVEL } else { usize::MAX },
        order: Vec::new(),
        nodes: Vec::with_capacity(tree.nodes.len() / 2 + 1),
        triangles: Vec::with_capacity(primitives.pieces.prims.len()),
        leaf_boxes: Vec::with_capacity(primitives.pieces.prims.len()),
    };
    layout.all();
    let Layout { mut nodes, triangles, leaf_boxes, .. } = layout;
    let mut slots = vec![0; positions.len()];
    for (slot, triangle) in triangles.iter().enumerate() {
        slots[triangle.prim as usize] = slot as u32;
    }
    let bounds = fit(&mut nodes, &leaf_boxes);
    Bvh { nodes, triangles, slots, bounds, triangle_count: positions.len() }
}

/// Inner nodes on the longest way down. Without recursion: a chain may be as long as the scene.
fn depth(tree: &Bvh2) -> usize {
    let mut pending = vec![(0, 0)];
    let mut deepest = 0;
    while let Some((index, above)) = pending.pop() {
        let node = &tree.nodes[index];
        deepest = deepest.max(above);
        if !node.is_leaf() {
            pending.extend([0, 1].map(|side| (node.first_index as usize + side, above + 1)));
        }
    }
    deepest
}

/// A part of the tree still to be laid out.
enum Part {
    /// A node of the source.
    Source(usize),
    /// Pieces in `Layout::order`, to be halved down to leaves.
    Pieces(Range<usize>),
}

struct Layout<'a> {
    tree: &'a Bvh2,
    primitives: &'a BuildPrimitives,
    positions: &'a [[Vec3; 3]],
    /// Level from which subtrees are halved, whatever the source says.
    halved_from: usize,
    /// Pieces of leaves and of subtrees that are halved.
    order: Vec<u32>,
    nodes: Vec<Node>,
    triangles: Vec<Triangle>,
    /// Box of the leaf that each of `triangles` is in.
    leaf_boxes: Vec<Aabb>,
}

impl Layout<'_> {
    /// Walks the tree with a stack of (part, its level, where its link belongs).
    fn all(&mut self) {
        let mut pending = vec![(Part::Source(0), 0, None)];
        while let Some((part, level, parent)) = pending.pop() {
            let (link, children) = self.place(part, level);
            match parent {
                Some((node, side)) => self.link(node, side, link, level),
                None if link & LEAF_BIT != 0 => self.lone_leaf(link),
                None => {}
            }
            if let Some([first, second]) = children {
                pending.push((second, level + 1, Some((link, 1))));
                pending.push((first, level + 1, Some((link, 0))));
            }
        }
    }

    fn link(&mut self, parent: u32, side: usize, link: u32, level: usize) {
        self.nodes[parent as usize].child[side] = link;
        if link & LEAF_BIT == 0 {
            let node = &mut self.nodes[link as usize];
            (node.parent, node.level) = (parent, level as u32);
        }
    }

    /// Appends a leaf, or an inner node whose links are still to come; returns its link and its children.
    fn place(&mut self, part: Part, level: usize) -> (u32, Option<[Part; 2]>) {
        let range = match part {
            Part::Pieces(range) => range,
            Part::Source(index) if self.tree.nodes[index].is_leaf() || level >= self.halved_from => {
                // Depth-first, so no part of what was gathered before is pending.
                self.order.clear();
                self.gather(index)
            }
            Part::Source(index) => {
                let first = self.tree.nodes[index].first_index as usize;
                return (self.inner(), Some([Part::Source(first), Part::Source(first + 1)]));
            }
        };
        if range.len() <= MAX_LEAF_TRIANGLES as usize {
            return (self.leaf(range), None);
        }
        let middle = range.start + range.len() / 2;
        let halves = [range.start..middle, middle..range.end];
        (self.inner(), Some(halves.map(Part::Pieces)))
    }

    /// Appends all pieces below a node of the source to `order`, neighbours together.
    fn gather(&mut self, index: usize) -> Range<usize> {
        let start = self.order.len();
        let mut pending = vec![index];
        while let Some(index) = pending.pop() {
            let node = &self.tree.nodes[index];
            let first = node.first_index as usize;
            if node.is_leaf() {
                let leaf = &self.tree.primitive_indices[first..first + node.prim_count as usize];
                self.order.extend(leaf.iter().flat_map(|&primitive| self.primitives.pieces_of(primitive)));
            } else {
                pending.extend([first + 1, first]);
            }
        }
        start..self.order.len()
    }

    fn inner(&mut self) -> u32 {
        self.nodes.push(node([(NOWHERE, EMPTY_LEAF); 2]));
        self.nodes.len() as u32 - 1
    }

    /// Appends a leaf's triangles, lowest primitive id first, each once however many pieces of it the leaf has.
    fn leaf(&mut self, range: Range<usize>) -> u32 {
        let pieces = &mut self.order[range];
        let prim = |&piece: &u32| self.primitives.pieces.prims[piece as usize];
        pieces.sort_unstable_by_key(prim);
        let first = self.triangles.len();
        self.triangles.extend(pieces.chunk_by(|a, b| prim(a) == prim(b)).map(|same| {
            let prim = prim(&same[0]);
            let [v0, v1, v2] = self.positions[prim as usize].map(Into::into);
            Triangle { v0, prim, v1, pad1: 0, v2, pad2: 0 }
        }));
        self.leaf_boxes.resize(self.triangles.len(), self.primitives.pieces.union(pieces));
        let count = (self.triangles.len() - first) as u32;
        LEAF_BIT | count << LEAF_COUNT_SHIFT | first as u32
    }

    /// A root for a tree that is one leaf.
    fn lone_leaf(&mut self, link: u32) {
        self.nodes.push(node([(NOWHERE, link), (NOWHERE, EMPTY_LEAF)]));
    }
}

/// Gives all nodes their boxes, from the leaves up; returns the scene's. The boxes that the tree was built
/// over may be larger.
fn fit(nodes: &mut [Node], leaf_boxes: &[Aabb]) -> (Vec3, Vec3) {
    let mut boxes = vec![Aabb::empty(); nodes.len()];
    // Children come after their parents.
    for index in (0..nodes.len()).rev() {
        let children = nodes[index].child.map(|link| {
            let aabb = match link {
                EMPTY_LEAF => Aabb::empty(),
                _ if link & LEAF_BIT == 0 => boxes[link as usize],
                _ => leaf_boxes[(link & LEAF_FIRST_MASK) as usize],
            };
            (aabb, link)
        });
        boxes[index] = children[0].0.union(&children[1].0);
        let fitted = node(children.map(|(aabb, link)| match link {
            EMPTY_LEAF => (NOWHERE, link),
            _ => ((aabb.min.into(), aabb.max.into()), link),
        }));
        let Node { parent, level, .. } = nodes[index];
        nodes[index] = Node { parent, level, ..fitted };
    }
    (boxes[0].min.into(), boxes[0].max.into())
}
