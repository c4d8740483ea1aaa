//! What lies below each node: the numbers that cuts and owners are decided by.

use super::Hierarchy;
use crate::bvh::statistics::{child_bounds, half_area};
use crate::layout::{Node, Triangle};
use crate::shared::{LEAF_BIT, LEAF_COUNT_MASK, LEAF_COUNT_SHIFT};

/// A node or leaf and all below it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Below {
    /// Inner nodes.
    pub nodes: u32,
    /// Triangles.
    pub triangles: u32,
    /// Inner nodes on the longest way down.
    pub depth: u32,
    /// Chance that a ray which meets the scene's box meets this one: surface area over the scene's
    /// (MacDonald and Booth 1990).
    pub visits: f64,
    /// Expected node visits and triangle tests of such a ray.
    pub work: f64,
}

impl Below {
    /// Bytes of nodes and triangles.
    pub fn bytes(&self) -> u64 {
        u64::from(self.nodes) * size_of::<Node>() as u64 + u64::from(self.triangles) * size_of::<Triangle>() as u64
    }
}

/// All nodes, each after those below it.
pub fn children_first(nodes: &[Node]) -> Vec<u32> {
    let (mut order, mut pending) = (Vec::with_capacity(nodes.len()), vec![0]);
    while let Some(index) = pending.pop() {
        order.push(index);
        pending.extend(nodes[index as usize].child.iter().filter(|&link| link & LEAF_BIT == 0));
    }
    order.reverse();
    order
}

/// [`Below`] of every node, and of leaves by the box that their parent holds.
pub struct Measures<'a> {
    tree: &'a [Node],
    nodes: Vec<Below>,
    scene_area: f64,
}

impl<'a> Measures<'a> {
    /// Measures the whole tree.
    pub fn of(tree: Hierarchy<'a>) -> Measures<'a> {
        let scene_area = half_area(tree.bounds.0, tree.bounds.1).max(f64::MIN_POSITIVE);
        let mut measures = Measures { tree: tree.nodes, nodes: vec![Below::default(); tree.nodes.len()], scene_area };
        for index in children_first(tree.nodes) {
            let children = [0, 1].map(|side| measures.child(index, side));
            measures.nodes[index as usize] = Below {
                nodes: 1 + children[0].nodes + children[1].nodes,
                triangles: children[0].triangles + children[1].triangles,
                depth: 1 + children[0].depth.max(children[1].depth),
                visits: 1.0,
                work: children[0].work + children[1].work,
            };
        }
        measures
    }

    /// The whole tree.
    pub fn root(&self) -> Below {
        Below { work: self.nodes[0].work + 1.0, ..self.nodes[0] }
    }

    /// Below child `side` of a node.
    pub fn child(&self, parent: u32, side: usize) -> Below {
        let node = &self.tree[parent as usize];
        let link = node.child[side];
        let visits = match link {
            LEAF_BIT => 0.0,
            _ => {
                let (low, high) = child_bounds(node, side);
                half_area(low, high) / self.scene_area
            }
        };
        if link & LEAF_BIT != 0 {
            let triangles = link >> LEAF_COUNT_SHIFT & LEAF_COUNT_MASK;
            return Below { triangles, visits, work: visits * f64::from(triangles), ..Below::default() };
        }
        let below = self.nodes[link as usize];
        Below { visits, work: visits + below.work, ..below }
    }
}
