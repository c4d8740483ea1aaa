//! Passes of the counting sort that makes queues, as the kernels `queue_count`, `queue_prefix`, `queue_scatter` and
//! `queue_shares` run them (`glsl/include/queue.glsl`).

use crate::shared::{DIGIT_BITS, DIGITS, LEAST_STRIP, MOST_TILES, PREFIX_LANES, WARP};

/// Which of the kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Counts the digits of each tile.
    Count,
    /// Turns counts into places.
    Prefix,
    /// Moves entries to their places.
    Scatter,
    /// Finds where the entries of each multiprocessor begin.
    Shares,
}

/// One launch of a queue kernel.
#[derive(Clone, Copy, Debug)]
pub struct Pass<'a> {
    /// The kernel.
    pub kind: Kind,
    /// Entries sorted.
    pub entries: usize,
    /// Multiprocessors.
    pub sms: u32,
    /// Place of each entry afterwards.
    pub places: &'a [u32],
}

impl Pass<'_> {
    /// Entries that a thread goes through (`glsl/include/batch.glsl`).
    pub fn strip(&self) -> usize {
        self.entries.div_ceil((WARP * MOST_TILES) as usize).max(LEAST_STRIP as usize)
    }

    /// Blocks of the counting and scattering kernels.
    pub fn tiles(&self) -> usize {
        self.entries.div_ceil(WARP as usize * self.strip())
    }

    /// Counts that a thread of the prefix kernel sums up.
    pub fn part(&self) -> usize {
        (DIGITS as usize * self.tiles()).div_ceil(PREFIX_LANES as usize)
    }

    /// Threads of a block.
    pub fn block_threads(&self) -> usize {
        if self.kind == Kind::Prefix { PREFIX_LANES as usize } else { WARP as usize }
    }

    /// Threads of the launch.
    pub fn threads(&self) -> usize {
        match self.kind {
            Kind::Count | Kind::Scatter => self.tiles() * WARP as usize,
            Kind::Prefix => PREFIX_LANES as usize,
            Kind::Shares => self.sms as usize + 1,
        }
    }
}

/// Digits by which queues of `subtrees` subtrees are sorted.
pub fn digits(subtrees: usize) -> u32 {
    subtrees.max(2).next_power_of_two().ilog2().div_ceil(DIGIT_BITS)
}

/// Place of each entry after a stable sort by digit `digit` of its subtree.
pub fn places(subtrees: impl Iterator<Item = u32> + Clone, digit: u32) -> Vec<u32> {
    let digit_of = |subtree: u32| (subtree >> (digit * DIGIT_BITS) & (DIGITS - 1)) as usize;
    let mut next = [0u32; DIGITS as usize + 1];
    subtrees.clone().for_each(|subtree| next[digit_of(subtree) + 1] += 1);
    (1..next.len()).for_each(|digit| next[digit] += next[digit - 1]);
    let place = |subtree| {
        let place = &mut next[digit_of(subtree)];
        *place += 1;
        *place - 1
    };
    subtrees.map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_digits_sort_65536_subtrees_and_keep_the_order_of_equals() {
        let subtrees: Vec<u32> = (0..1000u32).map(|i| i.wrapping_mul(2_654_435_761) >> 16 & 0x3ff).collect();
        let mut sorted: Vec<(u32, usize)> = subtrees.iter().copied().zip(0..).collect();
        for digit in 0..digits(1024) {
            let places = places(sorted.iter().map(|&(subtree, _)| subtree), digit);
            let mut moved = sorted.clone();
            sorted.iter().zip(places).for_each(|(&entry, place)| moved[place as usize] = entry);
            sorted = moved;
        }
        assert!(sorted.is_sorted());
    }

    #[test]
    fn as_many_digits_as_subtrees_need() {
        assert_eq!([1, 2, 256, 257, 65_536, 65_537].map(digits), [1, 1, 1, 2, 2, 3]);
    }
}
