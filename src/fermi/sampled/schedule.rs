//! The block scheduler, with the time of each block known beforehand.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// When the last of blocks that take `cycles` ends, and when a slot is done in the mean. A block starts in the slot
/// that is first free, in the order of the launch (list scheduling: Graham 1969).
pub(super) fn makespan(slots: usize, cycles: impl Iterator<Item = f64>) -> (f64, f64) {
    // Times are not negative, so their bits are in the order of their values.
    let mut free: BinaryHeap<Reverse<u64>> = (0..slots).map(|_| Reverse(0)).collect();
    for cycles in cycles {
        if let Some(mut first) = free.peek_mut() {
            first.0 = (f64::from_bits(first.0) + cycles.max(0.0)).to_bits();
        }
    }
    let ends = || free.iter().map(|end| f64::from_bits(end.0));
    (ends().fold(0.0, f64::max), ends().sum::<f64>() / slots.max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::makespan;

    #[test]
    fn a_late_long_block_makes_the_others_wait() {
        assert_eq!(makespan(2, [1.0, 1.0, 1.0, 5.0].into_iter()), (6.0, 4.0));
        assert_eq!(makespan(2, [5.0, 1.0, 1.0, 1.0].into_iter()), (5.0, 4.0));
        assert_eq!(makespan(3, std::iter::empty()), (0.0, 0.0));
    }
}
