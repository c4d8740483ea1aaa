//! What `caribou info --partition` says.

use serde::Serialize;

use super::Partition;
use crate::layout::Node;

/// Numbers of a partition.
#[derive(Clone, Debug, Serialize)]
pub struct PartitionStatistics {
    /// How the tree was cut.
    pub policy: String,
    /// SMs that own subtrees.
    pub sms: u32,
    /// Subtrees.
    pub subtrees: usize,
    /// Nodes of the top tree.
    pub top_nodes: usize,
    /// Bytes of the top tree.
    pub top_bytes: usize,
    /// Inner nodes on the longest way down the top tree.
    pub top_depth: u32,
    /// Top-tree nodes that a ray which meets the scene's box is expected to visit, by surface area.
    pub expected_top_visits: f64,
    /// Subtrees that it is expected to visit, if no hit ends it early.
    pub expected_subtree_visits: f64,
    /// Work of the busiest SM over the mean, as expected.
    pub imbalance: f64,
    /// Bytes of nodes and triangles of a subtree.
    pub bytes: Histogram,
    /// Triangles of a subtree.
    pub triangles: Histogram,
    /// Levels of inner nodes of a subtree; 0 for a leaf.
    pub depth: Histogram,
}

/// How often values lie in ranges that double: 0, 1, 2-3, 4-7, ...
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Histogram {
    /// Smallest value.
    pub min: u64,
    /// Mean.
    pub mean: f64,
    /// Largest value.
    pub max: u64,
    /// Lower end of each range that holds something, and how many values it holds.
    pub ranges: Vec<(u64, usize)>,
}

impl Histogram {
    /// Of any values.
    pub fn of(values: impl Iterator<Item = u64>) -> Histogram {
        let mut histogram = Histogram { min: u64::MAX, ..Histogram::default() };
        let mut counts = [0usize; 65];
        let (mut sum, mut n) = (0u128, 0usize);
        for value in values {
            histogram.min = histogram.min.min(value);
            histogram.max = histogram.max.max(value);
            counts[64 - value.leading_zeros() as usize] += 1;
            sum += u128::from(value);
            n += 1;
        }
        histogram.min = histogram.min.min(histogram.max);
        histogram.mean = sum as f64 / n.max(1) as f64;
        let low = |bits: usize| if bits == 0 { 0 } else { 1u64 << (bits - 1) };
        let held = counts.iter().enumerate().filter(|&(_, &count)| count > 0);
        histogram.ranges = held.map(|(bits, &count)| (low(bits), count)).collect();
        histogram
    }
}

impl PartitionStatistics {
    /// Of a partition.
    pub fn of(partition: &Partition) -> PartitionStatistics {
        let below = &partition.below;
        let mut work = vec![0.0; partition.sms() as usize];
        partition.subtrees.iter().zip(below).for_each(|(subtree, below)| work[subtree.owner as usize] += below.work);
        let mean = work.iter().sum::<f64>() / work.len() as f64;
        let busiest = work.iter().copied().fold(0.0, f64::max);
        PartitionStatistics {
            policy: partition.policy.to_string(),
            sms: partition.sms(),
            subtrees: below.len(),
            top_nodes: partition.top.len(),
            top_bytes: size_of::<Node>() * partition.top.len(),
            top_depth: partition.top.iter().map(|node| node.level + 1).max().unwrap_or(0),
            expected_top_visits: partition.top_visits,
            expected_subtree_visits: below.iter().map(|below| below.visits).sum(),
            imbalance: if mean > 0.0 { busiest / mean } else { 1.0 },
            bytes: Histogram::of(below.iter().map(|below| below.bytes())),
            triangles: Histogram::of(below.iter().map(|below| below.triangles.into())),
            depth: Histogram::of(below.iter().map(|below| below.depth.into())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn histograms_double_their_ranges() {
        let histogram = Histogram::of([0, 1, 3, 2, 8, 15].into_iter());
        assert_eq!(histogram.ranges, [(0, 1), (1, 1), (2, 2), (8, 2)]);
        assert_eq!((histogram.min, histogram.max), (0, 15));
        assert!((histogram.mean - 29.0 / 6.0).abs() < 1e-12);
        assert_eq!(Histogram::of([].into_iter()), Histogram::default());
    }
}
