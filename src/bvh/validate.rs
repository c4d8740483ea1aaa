//! Whether a BVH is what traversal takes it for.

use glam::Vec3;

use super::build::Bvh;
use super::statistics::child_bounds;
use crate::shared::{LEAF_BIT, LEAF_COUNT_MASK, LEAF_COUNT_SHIFT, LEAF_FIRST_MASK, MAX_LEAF_TRIANGLES, STACK_SIZE};

impl Bvh {
    /// Checks the structure against the `positions` it was built over: links, order, depth, boxes, slots,
    /// and that every triangle is in exactly one leaf.
    ///
    /// # Errors
    /// The first thing found wrong, in words.
    pub fn validate(&self, positions: &[[Vec3; 3]]) -> Result<(), String> {
        if self.triangle_count != positions.len() {
            return Err(format!("{} triangles for {} positions", self.triangle_count, positions.len()));
        }
        let mut walk = Walk { bvh: self, nodes: 0, triangles: 0 };
        walk.nodes()?;
        if (walk.nodes, walk.triangles) != (self.nodes.len(), positions.len()) {
            return Err(format!("{} nodes and {} triangles are reached", walk.nodes, walk.triangles));
        }
        self.check_triangles(positions)
    }

    /// Each triangle is its primitive's, and the slots are the way back: so each primitive is there once.
    fn check_triangles(&self, positions: &[[Vec3; 3]]) -> Result<(), String> {
        for (slot, triangle) in self.triangles[..self.triangle_count].iter().enumerate() {
            let prim = triangle.prim as usize;
            let corners = [triangle.v0, triangle.v1, triangle.v2].map(Vec3::from);
            if positions.get(prim) != Some(&corners) {
                return Err(format!("slot {slot} has not the corners of its primitive {prim}"));
            }
            if self.slots[prim] as usize != slot {
                return Err(format!("primitive {prim} is in slot {slot}, not in {}", self.slots[prim]));
            }
        }
        Ok(())
    }
}

/// A walk in the order of the layout: a node, all below its first child, all below its second.
struct Walk<'a> {
    bvh: &'a Bvh,
    /// Nodes met so far, which is the index of the next.
    nodes: usize,
    /// Triangles met so far.
    triangles: usize,
}

impl Walk<'_> {
    fn nodes(&mut self) -> Result<(), String> {
        let everywhere = (Vec3::NEG_INFINITY, Vec3::INFINITY);
        let mut pending = vec![(0, 0, everywhere, 1)];
        while let Some((parent, link, bounds, depth)) = pending.pop() {
            if link & LEAF_BIT != 0 {
                self.leaf(link, bounds).map_err(|problem| format!("leaf under node {parent}: {problem}"))?;
                continue;
            }
            if link as usize != self.nodes || self.nodes >= self.bvh.nodes.len() {
                return Err(format!("node {parent} links to {link}, where {} would be next", self.nodes));
            }
            if depth > STACK_SIZE {
                return Err(format!("node {link} is {depth} levels deep"));
            }
            self.nodes += 1;
            let node = &self.bvh.nodes[link as usize];
            if (node.parent, node.level + 1) != (parent, depth) {
                return Err(format!("node {link} says its parent is {} and its level {}", node.parent, node.level));
            }
            for side in [1, 0] {
                let child = child_bounds(node, side);
                if node.child[side] != LEAF_BIT && !contains(bounds, child) {
                    return Err(format!("child {side} of node {link} sticks out of the node's own box"));
                }
                pending.push((link, node.child[side], child, depth + 1));
            }
        }
        Ok(())
    }

    fn leaf(&mut self, link: u32, bounds: (Vec3, Vec3)) -> Result<(), String> {
        let count = (link >> LEAF_COUNT_SHIFT) & LEAF_COUNT_MASK;
        if count == 0 {
            return Ok(());
        }
        let first = (link & LEAF_FIRST_MASK) as usize;
        let range = first..first + count as usize;
        if count > MAX_LEAF_TRIANGLES || first != self.triangles || range.end > self.bvh.triangle_count {
            return Err(format!("triangles {range:?}, where {} would be next", self.triangles));
        }
        self.triangles = range.end;
        let triangles = &self.bvh.triangles[range];
        if !triangles.is_sorted_by_key(|triangle| triangle.prim) {
            return Err("its triangles are not in the order of their ids".to_owned());
        }
        let corners = triangles.iter().flat_map(|t| [t.v0, t.v1, t.v2]).map(Vec3::from);
        match corners.into_iter().find(|&corner| !contains(bounds, (corner, corner))) {
            Some(corner) => Err(format!("{corner} is outside of its box {bounds:?}")),
            None => Ok(()),
        }
    }
}

fn contains((low, high): (Vec3, Vec3), (inner_low, inner_high): (Vec3, Vec3)) -> bool {
    low.cmple(inner_low).all() && high.cmpge(inner_high).all()
}
