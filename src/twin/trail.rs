//! Twin of `trail.glsl`: a traversal stack as 64 bits.

use super::traverse::{Cursor, is_node};
use crate::layout::Node;

/// Bit L is set where the other child of the ancestor at level L is still to be visited.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Trail(pub u64);

impl Trail {
    /// As records hold it.
    pub fn from_words([low, high]: [u32; 2]) -> Trail {
        Trail(u64::from(low) | u64::from(high) << 32)
    }

    /// As records hold it.
    pub fn words(self) -> [u32; 2] {
        [self.0 as u32, (self.0 >> 32) as u32]
    }

    /// Notes that a child of the ancestor at `level` is pending.
    pub fn put(&mut self, level: u32) {
        self.0 |= 1 << level;
    }

    /// Whether nothing is pending.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Deepest level at which a child is pending; the trail must not be empty.
    pub fn deepest(self) -> u32 {
        self.0.ilog2()
    }

    /// The levels above `level`, which is 64 for leaves below the deepest nodes.
    pub fn above(self, level: u32) -> Trail {
        Trail(self.0 & 1u64.checked_shl(level).map_or(u64::MAX, |bit| bit - 1))
    }
}

/// The child of `node` that is not at `link`.
pub fn other_child(node: &Node, link: u32) -> u32 {
    node.child[usize::from(node.child[0] == link)]
}

/// The child of a node below which, or at which, the node `link` is: what is below the second child comes last.
fn child_towards(node: &Node, link: u32) -> u32 {
    let [first, second] = node.child;
    if is_node(second) && link >= second { second } else { first }
}

/// `trail` and what is on the stack of a ray that stands at a node in the tree below `root`.
pub fn trail_of_stack(nodes: &[Node], (root, root_level): (u32, u32), cursor: &Cursor, mut trail: Trail) -> Trail {
    let (mut at, mut level, mut noted) = (root, root_level, 0);
    while noted < cursor.depth && at != cursor.link {
        let node = &nodes[at as usize];
        at = child_towards(node, cursor.link);
        if cursor.stack[noted] == other_child(node, at) {
            trail.put(level);
            noted += 1;
        }
        level += 1;
    }
    trail
}

/// The way back: fills the stack with what is pending from `root_level` down.
pub fn cursor_of_trail(nodes: &[Node], (root, root_level): (u32, u32), link: u32, trail: Trail) -> Cursor {
    let mut cursor = Cursor::at(link);
    let depth = (trail.0 ^ trail.above(root_level).0).count_ones() as usize;
    let (mut at, mut level) = (root, root_level);
    while cursor.depth < depth {
        let node = &nodes[at as usize];
        at = child_towards(node, link);
        if trail.0 >> level & 1 != 0 {
            cursor.stack[cursor.depth] = other_child(node, at);
            cursor.depth += 1;
        }
        level += 1;
    }
    cursor
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::{Bvh, Quality};
    use crate::scene::procedural;
    use crate::shared::LEAF_BIT;

    /// Every node, reached along a way on which each second level is put off, and all of them.
    #[test]
    fn a_stack_survives_as_a_trail() {
        let scene = procedural::build("needles", 3_000, 1).unwrap();
        let bvh = Bvh::build(&scene.positions, Quality::default()).unwrap();
        for node in 0..bvh.nodes.len() as u32 {
            for mask in [0x5555_5555_5555_5555, u64::MAX, 0] {
                let mut cursor = Cursor::at(node);
                let mut way = vec![node];
                while let Some(&last) = way.last().filter(|&&last| last != 0) {
                    way.push(bvh.nodes[last as usize].parent);
                }
                for pair in way.windows(2).rev() {
                    let parent = &bvh.nodes[pair[1] as usize];
                    if mask >> parent.level & 1 != 0 {
                        cursor.stack[cursor.depth] = other_child(parent, pair[0]);
                        cursor.depth += 1;
                    }
                }
                let trail = trail_of_stack(&bvh.nodes, (0, 0), &cursor, Trail::default());
                assert_eq!(trail.0, mask & ((1 << bvh.nodes[node as usize].level) - 1));
                let back = cursor_of_trail(&bvh.nodes, (0, 0), node, Trail::from_words(trail.words()));
                assert_eq!((back.depth, back.stack), (cursor.depth, cursor.stack));
            }
        }
        assert!(bvh.nodes.iter().any(|node| node.child[0] & LEAF_BIT != 0));
    }
}
