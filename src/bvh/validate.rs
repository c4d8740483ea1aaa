//! Whether a BVH is what traversal takes it for.

use glam::Vec3;

use super::build::Bvh;
use super::statistics::child_bounds;
use crate::layout::Triangle;
use crate::shared::{LEAF_BIT, LEAF_COUNT_MASK, LEAF_COUNT_SHIFT, LEAF_FIRST_MASK, MAX_LEAF_TRIANGLES, STACK_SIZE};

impl Bvh {
    /// Checks the structure against the `positions` it was built over: links, order, depth, boxes, slots,
    /// and that the boxes of the leaves that hold a triangle cover it.
    ///
    /// # Errors
    /// The first thing found wrong, in words.
    pub fn validate(&self, positions: &[[Vec3; 3]]) -> Result<(), String> {
        if self.triangle_count != positions.len() {
            return Err(format!("{} triangles for {} positions", self.triangle_count, positions.len()));
        }
        self.check_triangles(positions)?;
        let mut walk = Walk { bvh: self, nodes: 0, triangles: 0, covered: vec![0; positions.len()] };
        walk.nodes()?;
        if (walk.nodes, walk.triangles) != (self.nodes.len(), self.references()) {
            return Err(format!("{} nodes and {} triangles are reached", walk.nodes, walk.triangles));
        }
        match walk.covered.iter().position(|&points| points != ALL_PROBES) {
            Some(prim) => Err(format!("parts of triangle {prim} are in no leaf's box: {:#b}", walk.covered[prim])),
            None => Ok(()),
        }
    }

    /// Each triangle is its primitive's, and the slots are a way back: so each primitive is there.
    fn check_triangles(&self, positions: &[[Vec3; 3]]) -> Result<(), String> {
        for (slot, triangle) in self.triangles[..self.references()].iter().enumerate() {
            let corners = [triangle.v0, triangle.v1, triangle.v2].map(Vec3::from);
            if positions.get(triangle.prim as usize) != Some(&corners) {
                return Err(format!("slot {slot} has not the corners of its primitive {}", triangle.prim));
            }
        }
        let lost = |(prim, &slot): (usize, &u32)| {
            let found = self.triangles.get(slot as usize).map(|triangle| triangle.prim as usize);
            (found != Some(prim)).then(|| format!("primitive {prim} is not in slot {slot}, but {found:?}"))
        };
        self.slots[..positions.len()].iter().enumerate().find_map(lost).map_or(Ok(()), Err)
    }
}

/// Points of a triangle of which each must be in one of its leaves' boxes: corners, middles of edges, and one
/// inside: rounding cannot take them out of the triangle's box.
fn probes(triangle: &Triangle) -> [Vec3; 7] {
    let [a, b, c] = [triangle.v0, triangle.v1, triangle.v2].map(Vec3::from);
    let middle = |a: Vec3, b: Vec3| (a + b) * 0.5;
    [a, b, c, middle(a, b), middle(b, c), middle(c, a), middle(middle(a, b), c)]
}

/// A bit for each of [`probes`].
const ALL_PROBES: u8 = 0b111_1111;

/// A walk in the order of the layout: a node, all below its first child, all below its second.
struct Walk<'a> {
    bvh: &'a Bvh,
    /// Nodes met so far, which is the index of the next.
    nodes: usize,
    /// Triangles met so far.
    triangles: usize,
    /// For each primitive, which of its [`probes`] are in the box of a leaf with it.
    covered: Vec<u8>,
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
        if count > MAX_LEAF_TRIANGLES || first != self.triangles || range.end > self.bvh.references() {
            return Err(format!("triangles {range:?}, where {} would be next", self.triangles));
        }
        self.triangles = range.end;
        let triangles = &self.bvh.triangles[range];
        if !triangles.is_sorted_by(|a, b| a.prim < b.prim) {
            return Err("its triangles are not in the order of their ids, each once".to_owned());
        }
        for triangle in triangles {
            let inside = probes(triangle).map(|point| u8::from(contains(bounds, (point, point))));
            self.covered[triangle.prim as usize] |= inside.iter().rev().fold(0, |bits, bit| bits << 1 | bit);
        }
        Ok(())
    }
}

fn contains((low, high): (Vec3, Vec3), (inner_low, inner_high): (Vec3, Vec3)) -> bool {
    low.cmple(inner_low).all() && high.cmpge(inner_high).all()
}
