//! What a launch does not need.

use serde::Serialize;

use crate::fermi::caches::TreeInL2;
use crate::fermi::launch::Workload;
use crate::fermi::machine::{LINE, Machine};
use crate::fermi::simt::Layout;

/// Part of the L2 that the tree may fill and still stay: rays, hits and stacks pass through the rest.
const ROOM: f64 = 0.5;

/// Something left out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Skipped {
    /// What.
    pub what: &'static str,
    /// Why.
    pub why: String,
}

/// KiB of the tree and of the L2.
fn sizes(machine: &Machine, workload: &Workload) -> (u64, u64) {
    let tree = Layout::new(workload, 0).tree();
    ((tree.end - tree.start) * LINE / 1024, machine.l2.slice_kib * u64::from(machine.l2.slices))
}

/// Whether the tree's lines need to be replaced in the L2.
pub(super) fn tree_in_l2(machine: &Machine, workload: &Workload) -> TreeInL2 {
    let (tree, l2) = sizes(machine, workload);
    if tree as f64 <= ROOM * l2 as f64 { TreeInL2::Stays } else { TreeInL2::Replaced }
}

/// What is left out where `share` of the blocks are replayed.
pub(super) fn skipped(machine: &Machine, workload: &Workload, share: f64) -> Vec<Skipped> {
    let mut all = Vec::new();
    if tree_in_l2(machine, workload) == TreeInL2::Stays {
        let (tree, l2) = sizes(machine, workload);
        let why = format!("its {tree} KiB are at most half of the L2's {l2} KiB: cold misses only");
        all.push(Skipped { what: "replay of the BVH in the L2", why });
    }
    if share < 1.0 {
        let why = format!("{:.1} % of the blocks tell enough", 100.0 * share);
        all.push(Skipped { what: "replay of the other blocks", why });
    }
    all
}
