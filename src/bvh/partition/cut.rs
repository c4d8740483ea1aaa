//! Where a tree is cut.

use super::measure::{Below, Measures, children_first};
use super::policy::Policy;
use crate::layout::Node;
use crate::shared::LEAF_BIT;

/// Bytes that a ray moves by a pass through a queue: its record of 64 bytes, out and in.
const QUEUE_PASS_BYTES: f64 = 128.0;

/// A treelet's fixed cost is this part of an average treelet's share of the root's area, so that tiny
/// treelets do not pay (Aila and Karras 2010, section 4.1).
const TREELET_COST: f64 = 0.1;

/// Decides which nodes begin a subtree. Every leaf that no such node is above begins one of its own.
pub struct Cut<'a> {
    nodes: &'a [Node],
    policy: Policy,
    /// By node, whether a subtree that begins there is better than any cut below; for [`Policy::Sah`].
    best: Vec<bool>,
}

impl<'a> Cut<'a> {
    /// Prepares to cut a tree.
    pub fn new(nodes: &'a [Node], measures: &Measures, policy: Policy) -> Cut<'a> {
        let best = match policy {
            Policy::Sah(bytes) => cheapest(nodes, measures, bytes),
            _ => Vec::new(),
        };
        Cut { nodes, policy, best }
    }

    /// Whether a subtree begins at `link`, a node or leaf that no subtree is above.
    pub fn begins_at(&self, link: u32, below: &Below) -> bool {
        link & LEAF_BIT != 0
            || match self.policy {
                Policy::Level(level) => self.nodes[link as usize].level == level,
                Policy::Bytes(bytes) => below.bytes() <= bytes,
                Policy::Sah(_) => self.best[link as usize],
            }
    }
}

/// By node: is it cheaper to begin a subtree there than further down? Bottom up, by the bytes that a random
/// ray is expected to move: a node for each visit in the top tree, a record for each pass through a queue.
fn cheapest(nodes: &[Node], measures: &Measures, most_bytes: u64) -> Vec<bool> {
    let all_bytes = measures.root().bytes().max(1) as f64;
    let fixed = TREELET_COST * most_bytes as f64 / all_bytes;
    let subtree = |below: &Below| QUEUE_PASS_BYTES * (below.visits + fixed);
    let mut best = vec![false; nodes.len()];
    let mut below_cost = vec![0.0; nodes.len()];
    for index in children_first(nodes) {
        let node = &nodes[index as usize];
        let mut cost = 0.0;
        for side in 0..2 {
            let (link, below) = (node.child[side], measures.child(index, side));
            cost += if link & LEAF_BIT != 0 {
                subtree(&below)
            } else {
                let further_down = size_of::<Node>() as f64 * below.visits + below_cost[link as usize];
                best[link as usize] = below.bytes() <= most_bytes && subtree(&below) <= further_down;
                if best[link as usize] { subtree(&below) } else { further_down }
            };
        }
        below_cost[index as usize] = cost;
    }
    let root = measures.root();
    best[0] = root.bytes() <= most_bytes && subtree(&root) <= size_of::<Node>() as f64 + below_cost[0];
    best
}
