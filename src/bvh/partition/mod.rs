//! The tree cut into a top tree and subtrees, each owned by an SM.

mod cut;
mod measure;
mod owners;
mod policy;
mod statistics;
mod validate;

#[cfg(test)]
mod tests;

pub use owners::Owners;
pub use policy::Policy;
pub use statistics::PartitionStatistics;

use glam::Vec3;

use super::Bvh;
use crate::layout::{Node, Subtree};
use crate::shared::{LEAF_BIT, SUBTREE_LINK};
use crate::{Error, Result};
use cut::Cut;
use measure::{Below, Measures};

/// Most SMs; beyond those of any chip.
pub const MAX_SMS: u32 = 1024;

/// What is cut: the root is node 0, and nodes may lie in any order.
#[derive(Clone, Copy, Debug)]
pub struct Hierarchy<'a> {
    /// Boxes and links.
    pub nodes: &'a [Node],
    /// Low and high corner of the scene.
    pub bounds: (Vec3, Vec3),
}

/// A top tree and subtrees.
///
/// Nodes of the top tree are copies in depth-first order. Where a child begins a subtree, its link is
/// [`SUBTREE_LINK`] with the subtree's index in the low bits. Links inside subtrees are those of the
/// whole tree.
#[derive(Clone, Debug)]
pub struct Partition {
    /// How the tree was cut.
    pub policy: Policy,
    /// Nodes of the top tree; none if the whole tree is one subtree.
    pub top: Vec<Node>,
    /// Of each node of the top tree: its index in the whole tree.
    pub top_places: Vec<u32>,
    /// Where a walk of the top tree begins: a node of it, or subtree 0.
    pub root: u32,
    /// Subtrees in the order of their owners.
    pub subtrees: Vec<Subtree>,
    /// Subtrees of SM `s` are `first_of_sm[s]..first_of_sm[s + 1]`.
    pub first_of_sm: Vec<u32>,
    /// What lies below each subtree's root.
    below: Vec<Below>,
    /// Nodes of the top tree that a ray which meets the scene's box is expected to visit.
    top_visits: f64,
}

impl Partition {
    /// Cuts `bvh` and gives each subtree to one of `sms` SMs.
    ///
    /// # Errors
    /// [`Error::Usage`] if there are no SMs or more than [`MAX_SMS`].
    pub fn new(bvh: &Bvh, policy: Policy, owners: Owners, sms: u32) -> Result<Partition> {
        Partition::of(bvh.hierarchy(), policy, owners, sms)
    }

    /// Cuts any tree.
    ///
    /// # Errors
    /// As of [`Partition::new`].
    pub fn of(tree: Hierarchy, policy: Policy, owners: Owners, sms: u32) -> Result<Partition> {
        if !(1..=MAX_SMS).contains(&sms) {
            return Err(Error::usage(format!("--sms {sms}"), format!("give a number from 1 to {MAX_SMS}")));
        }
        let measures = Measures::of(tree);
        let mut partition = Partition {
            policy,
            top: Vec::new(),
            top_places: Vec::new(),
            root: 0,
            subtrees: Vec::new(),
            first_of_sm: Vec::new(),
            below: Vec::new(),
            top_visits: 0.0,
        };
        let places = partition.cut(tree.nodes, &measures, &Cut::new(tree.nodes, &measures, policy));
        partition.give(owners, sms, &places);
        Ok(partition)
    }

    /// SMs that subtrees were given to.
    pub fn sms(&self) -> u32 {
        self.first_of_sm.len() as u32 - 1
    }

    /// Walks the tree depth-first with a stack of (link, below, place), down to where subtrees begin. Returns
    /// the place of each subtree: node and side in the top tree, or `None` for the root.
    fn cut(&mut self, nodes: &[Node], measures: &Measures, cut: &Cut) -> Vec<Option<(u32, usize)>> {
        let mut places = Vec::new();
        let mut pending = vec![(0u32, measures.root(), None::<(u32, usize)>)];
        while let Some((link, below, place)) = pending.pop() {
            let (parent, level) = place.map_or((0, 0), |(parent, _)| (parent, self.top[parent as usize].level + 1));
            if cut.begins_at(link, &below) {
                self.subtrees.push(Subtree { root: link, parent, level, owner: 0 });
                self.below.push(below);
                places.push(place);
                continue;
            }
            let node = &nodes[link as usize];
            let index = self.top.len() as u32;
            self.top.push(Node { parent, ..*node });
            self.top_places.push(link);
            self.top_visits += below.visits;
            if let Some((parent, side)) = place {
                self.top[parent as usize].child[side] = index;
            }
            for side in [1, 0] {
                // An empty leaf stays what it is: no ray meets its box.
                if node.child[side] != LEAF_BIT {
                    pending.push((node.child[side], measures.child(link, side), Some((index, side))));
                }
            }
        }
        places
    }

    /// Assigns owners, puts the subtrees in their order and links the top tree to them.
    fn give(&mut self, owners: Owners, sms: u32, places: &[Option<(u32, usize)>]) {
        let work: Vec<f64> = self.below.iter().map(|below| below.work).collect();
        let assigned = owners.assign(&work, sms);
        let mut order: Vec<usize> = (0..work.len()).collect();
        order.sort_by_key(|&old| assigned[old]);
        self.subtrees = order.iter().map(|&old| Subtree { owner: assigned[old], ..self.subtrees[old] }).collect();
        self.below = order.iter().map(|&old| self.below[old]).collect();
        for (&old, index) in order.iter().zip(0..) {
            match places[old] {
                Some((parent, side)) => self.top[parent as usize].child[side] = SUBTREE_LINK | index,
                None => self.root = SUBTREE_LINK | index,
            }
        }
        let first = |sm| self.subtrees.partition_point(|subtree| subtree.owner < sm) as u32;
        self.first_of_sm = (0..=sms).map(first).collect();
    }
}
