//! Exchanged trees as ones that can be cut into subtrees.

use glam::Vec3;

use super::Tree;
use crate::layout::Node;
use crate::shared::{LEAF_BIT, LEAF_COUNT_MASK, LEAF_COUNT_SHIFT, LEAF_FIRST_MASK};

impl Tree {
    /// Nodes as this project has them, in the order of the file, and the low and high corner of all boxes. An
    /// axis along which a box is not finite, or inside out, has no extent.
    pub fn nodes(&self) -> (Vec<Node>, (Vec3, Vec3)) {
        let mut nodes: Vec<Node> = self.planes.iter().zip(&self.children).map(|(p, &child)| node(p, child)).collect();
        let mut pending = vec![0];
        while let Some(parent) = pending.pop() {
            for link in nodes[parent as usize].child {
                if link & LEAF_BIT == 0 {
                    nodes[link as usize].level = nodes[parent as usize].level + 1;
                    nodes[link as usize].parent = parent;
                    pending.push(link);
                }
            }
        }
        let corners = |k: [usize; 2]| k.map(|k| Vec3::new(nodes[0].x[k], nodes[0].y[k], nodes[0].z[k]));
        let ([low0, low1], [high0, high1]) = (corners([0, 2]), corners([1, 3]));
        (nodes, (low0.min(low1), high0.max(high1)))
    }

    /// Whether every leaf has triangles, and none that another leaf has too.
    ///
    /// # Errors
    /// The node above a leaf that fails, and how.
    pub fn check_leaves(&self) -> Result<(), (usize, String)> {
        let mut taken = vec![false; self.triangles.len()];
        for (node, link) in self.children.iter().enumerate().flat_map(|(node, links)| links.map(|link| (node, link))) {
            if link & LEAF_BIT == 0 {
                continue;
            }
            let (first, count) = (link & LEAF_FIRST_MASK, link >> LEAF_COUNT_SHIFT & LEAF_COUNT_MASK);
            if count == 0 {
                return Err((node, "has an empty leaf".to_owned()));
            }
            for triangle in first..first + count {
                if std::mem::replace(&mut taken[triangle as usize], true) {
                    return Err((node, format!("triangle {triangle} is in a second leaf")));
                }
            }
        }
        Ok(())
    }
}

fn node(planes: &[f32; 12], child: [u32; 2]) -> Node {
    let axis = |low: [usize; 2]| {
        let [a, b] = low.map(|k| (planes[k], planes[k + 1]));
        let sound =
            |(low, high): (f32, f32)| if low <= high && (high - low).is_finite() { [low, high] } else { [0.0; 2] };
        let ([low0, high0], [low1, high1]) = (sound(a), sound(b));
        [low0, high0, low1, high1]
    };
    Node { x: axis([0, 4]), y: axis([2, 6]), z: axis([8, 10]), child, parent: 0, level: 0 }
}
