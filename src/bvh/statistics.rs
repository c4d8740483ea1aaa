//! What `caribou info` and the benchmarks say of a BVH.

use glam::Vec3;

use super::build::Bvh;
use crate::layout::Node;
use crate::shared::{LEAF_BIT, LEAF_COUNT_MASK, LEAF_COUNT_SHIFT};

/// Counts in the terms of Zhu and Deng 2013, Table I, and the cost by the surface area heuristic.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Statistics {
    /// Triangles of the scene.
    pub triangles: usize,
    /// Triangles of all leaves together: more than `triangles` if large ones were cut.
    pub references: usize,
    /// Inner nodes, each with two boxes.
    pub nodes: usize,
    /// Leaves with at least one triangle.
    pub leaves: usize,
    /// Mean triangles a leaf.
    pub triangles_per_leaf: f64,
    /// Leaves with 0, 1, ... triangles.
    pub leaf_histogram: Vec<usize>,
    /// Inner nodes on the longest way from the root to a leaf.
    pub depth: usize,
    /// Expected cost of a random ray that meets the root's box: 1 a node visit, 1 a triangle test, each
    /// weighted by surface area over the root's (MacDonald and Booth 1990).
    pub sah_cost: f64,
    /// Bytes of the nodes.
    pub node_bytes: usize,
    /// Bytes of the triangles.
    pub triangle_bytes: usize,
}

impl Statistics {
    /// Walks the whole tree.
    pub fn of(bvh: &Bvh) -> Statistics {
        let mut histogram = vec![0; 9];
        let mut depth = 0;
        let mut cost = 1.0;
        let root_area = half_area(bvh.bounds.0, bvh.bounds.1).max(f64::MIN_POSITIVE);
        let mut pending = vec![(0u32, 1usize)];
        while let Some((index, level)) = pending.pop() {
            depth = depth.max(level);
            let node = &bvh.nodes[index as usize];
            for side in 0..2 {
                let link = node.child[side];
                let (low, high) = child_bounds(node, side);
                if link & LEAF_BIT == 0 {
                    cost += half_area(low, high) / root_area;
                    pending.push((link, level + 1));
                } else {
                    let count = (link >> LEAF_COUNT_SHIFT & LEAF_COUNT_MASK) as usize;
                    if count > 0 {
                        cost += half_area(low, high) / root_area * count as f64;
                        histogram[count] += 1;
                    }
                }
            }
        }
        let leaves: usize = histogram.iter().sum();
        Statistics {
            triangles: bvh.triangle_count,
            references: bvh.references(),
            nodes: bvh.nodes.len(),
            leaves,
            triangles_per_leaf: bvh.references() as f64 / leaves.max(1) as f64,
            leaf_histogram: histogram,
            depth,
            sah_cost: cost,
            node_bytes: size_of_val(&bvh.nodes[..]),
            triangle_bytes: size_of_val(&bvh.triangles[..]),
        }
    }
}

/// Box of child `side`.
pub fn child_bounds(node: &Node, side: usize) -> (Vec3, Vec3) {
    let k = 2 * side;
    (Vec3::new(node.x[k], node.y[k], node.z[k]), Vec3::new(node.x[k + 1], node.y[k + 1], node.z[k + 1]))
}

/// Half the surface area of a box.
pub(super) fn half_area(low: Vec3, high: Vec3) -> f64 {
    let d = (high - low).as_dvec3();
    d.x * d.y + d.y * d.z + d.z * d.x
}
