//! Passes of the counting sort that makes queues, as the kernels `queue_count`, `queue_prefix`, `queue_scatter` and
//! `queue_shares` run them (`glsl/include/queue.glsl`).

use crate::shared::{LEAST_STRIP, MOST_TILES, PREFIX_LANES, WARP};
use crate::trace::Digits;

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
    /// Values of a digit.
    pub digits: usize,
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
        (self.digits * self.tiles()).div_ceil(PREFIX_LANES as usize)
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

/// Place of each entry after a stable sort by the digit of pass `pass` of its subtree.
pub fn places(subtrees: impl Iterator<Item = u32> + Clone, digits: Digits, pass: u32) -> Vec<u32> {
    let digit_of = |subtree: u32| (subtree >> digits.shift(pass) & (digits.values() - 1)) as usize;
    let mut next = vec![0u32; digits.values() as usize + 1];
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
    fn two_digits_sort_1024_subtrees_and_keep_the_order_of_equals() {
        let subtrees: Vec<u32> = (0..1000u32).map(|i| i.wrapping_mul(2_654_435_761) >> 16 & 0x3ff).collect();
        let mut sorted: Vec<(u32, usize)> = subtrees.iter().copied().zip(0..).collect();
        let digits = Digits::of(1024);
        assert_eq!((digits.passes, digits.values()), (2, 32));
        for pass in 0..digits.passes {
            let places = places(sorted.iter().map(|&(subtree, _)| subtree), digits, pass);
            let mut moved = sorted.clone();
            sorted.iter().zip(places).for_each(|(&entry, place)| moved[place as usize] = entry);
            sorted = moved;
        }
        assert!(sorted.is_sorted());
    }

    #[test]
    fn as_many_digits_as_subtrees_need() {
        let passes = |subtrees| Digits::of(subtrees).passes;
        assert_eq!([0, 1, 2, 256, 257, 65_536, 65_537].map(passes), [1, 1, 1, 1, 2, 2, 3]);
        assert_eq!([1, 33, 256, 257, 65_537].map(|subtrees| Digits::of(subtrees).values()), [32, 64, 256, 32, 64]);
    }
}
