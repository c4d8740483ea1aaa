//! Whether a partition is what migration takes it for.

use super::Partition;
use super::policy::Policy;
use crate::bvh::Bvh;
use crate::layout::Node;
use crate::shared::{LEAF_BIT, LEAF_COUNT_MASK, LEAF_COUNT_SHIFT, SUBTREE_LINK};

impl Partition {
    /// Checks the structure against the tree: the top tree is a closed copy of its upper part, every leaf is
    /// in exactly one subtree, footprints are as promised, and owners are in order.
    ///
    /// # Errors
    /// The first thing found wrong, in words.
    pub fn validate(&self, bvh: &Bvh) -> Result<(), String> {
        let mut walk = Walk { partition: self, bvh, top: 0, subtrees: vec![false; self.subtrees.len()], leaves: 0 };
        walk.all()?;
        if walk.top as usize != self.top.len() {
            return Err(format!("{} of {} top nodes are reached", walk.top, self.top.len()));
        }
        if let Some(lost) = walk.subtrees.iter().position(|met| !met) {
            return Err(format!("subtree {lost} is not reached"));
        }
        let leaves = bvh.nodes.iter().flat_map(|node| node.child).filter(|&link| is_leaf(link)).count();
        if walk.leaves != leaves {
            return Err(format!("{} of {leaves} leaves are in subtrees", walk.leaves));
        }
        self.check_owners()
    }

    fn check_owners(&self) -> Result<(), String> {
        for (sm, range) in self.first_of_sm.windows(2).enumerate() {
            let owned = self.subtrees.get(range[0] as usize..range[1] as usize).ok_or("a range of subtrees is none")?;
            if let Some(subtree) = owned.iter().find(|subtree| subtree.owner as usize != sm) {
                return Err(format!("SM {sm} has a subtree of SM {}", subtree.owner));
            }
        }
        if self.first_of_sm.first() != Some(&0) || self.first_of_sm.last() != Some(&(self.subtrees.len() as u32)) {
            return Err("not every subtree is some SM's".to_owned());
        }
        Ok(())
    }
}

/// A leaf with triangles.
fn is_leaf(link: u32) -> bool {
    link & LEAF_BIT != 0 && link != LEAF_BIT
}

struct Walk<'a> {
    partition: &'a Partition,
    bvh: &'a Bvh,
    /// Top nodes met so far, which is the index of the next.
    top: u32,
    /// Subtrees met so far.
    subtrees: Vec<bool>,
    /// Leaves met so far.
    leaves: usize,
}

impl Walk<'_> {
    /// Both trees side by side: (link of the top tree, link of the whole tree, top node above, level).
    fn all(&mut self) -> Result<(), String> {
        let mut pending = vec![(self.partition.root, 0u32, 0u32, 0u32)];
        while let Some((link, whole, parent, level)) = pending.pop() {
            if link & LEAF_BIT != 0 {
                self.subtree(link.wrapping_sub(SUBTREE_LINK), whole, parent, level)?;
                continue;
            }
            let node = self.partition.top.get(link as usize).ok_or(format!("top node {link} is none"))?;
            let original = &self.bvh.nodes[whole as usize];
            let same = Node { child: original.child, parent: original.parent, ..*node } == *original;
            if link != self.top || !same || self.partition.top_places[link as usize] != whole {
                return Err(format!("top node {link} is not node {whole}"));
            }
            if (node.parent, node.level) != (parent, level) {
                return Err(format!("top node {link} says its parent is {} and its level {}", node.parent, node.level));
            }
            self.top += 1;
            for side in [1, 0] {
                if original.child[side] != LEAF_BIT {
                    pending.push((node.child[side], original.child[side], link, level + 1));
                }
            }
        }
        Ok(())
    }

    fn subtree(&mut self, index: u32, whole: u32, parent: u32, level: u32) -> Result<(), String> {
        let partition = self.partition;
        let subtree = partition.subtrees.get(index as usize).ok_or(format!("subtree {index} is none"))?;
        if std::mem::replace(&mut self.subtrees[index as usize], true) {
            return Err(format!("subtree {index} is reached twice"));
        }
        if (subtree.root, subtree.parent, subtree.level) != (whole, parent, level) {
            return Err(format!("subtree {index} is not at {whole}"));
        }
        let (mut nodes, mut triangles, mut pending) = (0u32, 0u32, vec![whole]);
        while let Some(link) = pending.pop() {
            if link & LEAF_BIT == 0 {
                nodes += 1;
                pending.extend(self.bvh.nodes[link as usize].child);
            } else if is_leaf(link) {
                self.leaves += 1;
                triangles += link >> LEAF_COUNT_SHIFT & LEAF_COUNT_MASK;
            }
        }
        let below = &partition.below[index as usize];
        if (below.nodes, below.triangles) != (nodes, triangles) {
            return Err(format!("subtree {index} has {nodes} nodes and {triangles} triangles, not {below:?}"));
        }
        match partition.policy {
            Policy::Bytes(most) | Policy::Sah(most) if below.bytes() > most => {
                Err(format!("subtree {index} takes {} bytes, {most} were promised", below.bytes()))
            }
            Policy::Level(cut) if level > cut || (level < cut && whole & LEAF_BIT == 0) => {
                Err(format!("subtree {index} begins at level {level}, not {cut}"))
            }
            _ => Ok(()),
        }
    }
}
