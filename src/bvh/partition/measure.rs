//! What lies below each node: the numbers that cuts and owners are decided by.

use crate::bvh::Bvh;
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

/// [`Below`] of every node, and of leaves by the box that their parent holds.
pub struct Measures<'a> {
    bvh: &'a Bvh,
    nodes: Vec<Below>,
    scene_area: f64,
}

impl<'a> Measures<'a> {
    /// Measures the whole tree.
    pub fn of(bvh: &'a Bvh) -> Measures<'a> {
        let scene_area = half_area(bvh.bounds.0, bvh.bounds.1).max(f64::MIN_POSITIVE);
        let mut measures = Measures { bvh, nodes: vec![Below::default(); bvh.nodes.len()], scene_area };
        // Depth-first order: children come after their parents.
        for index in (0..bvh.nodes.len()).rev() {
            let children = [0, 1].map(|side| measures.child(index as u32, side));
            measures.nodes[index] = Below {
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
        let node = &self.bvh.nodes[parent as usize];
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
