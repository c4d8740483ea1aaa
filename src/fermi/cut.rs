//! Which part of a cut tree each node and triangle belongs to.

use crate::bvh::Partition;
use crate::layout::{Node, Subtree};
use crate::shared::{LEAF_BIT, LEAF_COUNT_MASK, LEAF_COUNT_SHIFT, LEAF_FIRST_MASK, STEP_PUSHED};

/// The part of the tree that a step is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Home {
    /// The top tree, and the index of the node there.
    Top(u32),
    /// A subtree.
    Subtree(u32),
}

/// A partition, and the way back from nodes and triangles to its parts.
#[derive(Clone, Debug)]
pub struct Cut<'a> {
    partition: &'a Partition,
    nodes: Vec<Home>,
    /// Subtree of each triangle.
    triangles: Vec<u32>,
}

impl<'a> Cut<'a> {
    /// Of a tree of nodes with these `children` and of `triangles` triangles.
    pub fn new(partition: &'a Partition, children: &[[u32; 2]], triangles: usize) -> Cut<'a> {
        let mut cut = Cut { partition, nodes: vec![Home::Top(0); children.len()], triangles: vec![0; triangles] };
        for (&node, top) in partition.top_places.iter().zip(0..) {
            cut.nodes[node as usize] = Home::Top(top);
        }
        for (subtree, index) in partition.subtrees.iter().zip(0..) {
            let mut pending = vec![subtree.root];
            while let Some(link) = pending.pop() {
                if link & LEAF_BIT == 0 {
                    cut.nodes[link as usize] = Home::Subtree(index);
                    pending.extend(children[link as usize]);
                } else {
                    let first = (link & LEAF_FIRST_MASK) as usize;
                    let count = (link >> LEAF_COUNT_SHIFT & LEAF_COUNT_MASK) as usize;
                    cut.triangles[first..first + count].fill(index);
                }
            }
        }
        cut
    }

    /// Where the node or leaf of a step is; a leaf that is right below the top tree is a subtree.
    pub fn home(&self, step: u32) -> Home {
        match step & LEAF_BIT {
            0 => self.nodes[(step & !STEP_PUSHED) as usize],
            _ => Home::Subtree(self.triangles[(step & LEAF_FIRST_MASK) as usize]),
        }
    }

    /// Part of node number `node`, of the last node for numbers beyond.
    pub(super) fn of_node(&self, node: usize) -> Home {
        self.nodes[node.min(self.nodes.len() - 1)]
    }

    /// Subtree of triangle number `triangle`, of the last for numbers beyond.
    pub(super) fn of_triangle(&self, triangle: usize) -> u32 {
        self.triangles[triangle.min(self.triangles.len() - 1)]
    }

    /// Subtrees, in the order of their owners.
    pub fn subtrees(&self) -> &'a [Subtree] {
        &self.partition.subtrees
    }

    /// Nodes of the top tree.
    pub fn top(&self) -> &'a [Node] {
        &self.partition.top
    }

    /// Subtrees of multiprocessor `s` are `first_of_sm()[s]..first_of_sm()[s + 1]`.
    pub fn first_of_sm(&self) -> &'a [u32] {
        &self.partition.first_of_sm
    }

    /// Node of the top tree that a step's node or subtree is right below, none at the root.
    pub(super) fn above(&self, step: u32) -> Option<u32> {
        match self.home(step) {
            Home::Top(0) => None,
            Home::Top(index) => Some(self.partition.top[index as usize].parent),
            Home::Subtree(_) if self.partition.top.is_empty() => None,
            Home::Subtree(index) => Some(self.partition.subtrees[index as usize].parent),
        }
    }
}
