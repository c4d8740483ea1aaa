//! The block scheduler, with the time of each block known beforehand.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A machine to which blocks are given.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scheduler {
    /// Multiprocessors.
    pub(super) sms: usize,
    /// Blocks that each holds.
    pub(super) slots: usize,
    /// Part of its cycles that a block takes when the multiprocessor has no other. It grows by the same for each further one
    /// and is 1 when the multiprocessor is full.
    pub(super) by_itself: f64,
}

/// A multiprocessor at work.
#[derive(Clone, Debug, Default)]
struct Multiprocessor {
    /// Cycles left of its blocks, were it full.
    left: Vec<f64>,
    /// When it was left so.
    now: f64,
}

impl Scheduler {
    /// When the last multiprocessor is done with blocks that take so many `cycles` where it is full, and when one is in the
    /// mean. Blocks are given
    /// away in order, the next to the multiprocessor that is first done with one.
    pub(super) fn run(&self, mut cycles: impl Iterator<Item = f64>) -> (f64, f64) {
        let mut sms = vec![Multiprocessor::default(); self.sms];
        for _ in 0..self.slots {
            sms.iter_mut().for_each(|sm| sm.left.extend(cycles.next()));
        }
        // Times are not negative, so their bits are in the order of their values.
        let next = |sm: &Multiprocessor| {
            let least = sm.left.iter().copied().min_by(f64::total_cmp)?;
            Some((sm.now + least * self.pace(sm.left.len())).to_bits())
        };
        let mut ends: BinaryHeap<_> =
            sms.iter().enumerate().filter_map(|(number, sm)| Some(Reverse((next(sm)?, number)))).collect();
        while let Some(Reverse((end, number))) = ends.pop() {
            let sm = &mut sms[number];
            let done = (f64::from_bits(end) - sm.now) / self.pace(sm.left.len());
            sm.now = f64::from_bits(end);
            if let Some(first) = (0..sm.left.len()).min_by(|&a, &b| sm.left[a].total_cmp(&sm.left[b])) {
                sm.left.swap_remove(first);
            }
            sm.left.iter_mut().for_each(|left| *left = (*left - done).max(0.0));
            sm.left.extend(cycles.next());
            ends.extend(next(sm).map(|end| Reverse((end, number))));
        }
        let ends = || sms.iter().map(|sm| sm.now);
        (ends().fold(0.0, f64::max), ends().sum::<f64>() / self.sms as f64)
    }

    /// Part of its cycles that a block takes where `blocks` are at work in all.
    fn pace(&self, blocks: usize) -> f64 {
        let company = (blocks - 1) as f64 / (self.slots - 1).max(1) as f64;
        self.by_itself + (1.0 - self.by_itself) * company
    }
}

/// The blocks at work when number `next` is launched on a machine that holds `held` and gives each so many cycles as
/// `cycles` has, and for how many it has run: those that run longest first.
pub(super) fn at_work(held: usize, cycles: impl Iterator<Item = f64>, next: usize) -> Vec<(usize, f64)> {
    // When each ends, its number, and when it began; as above by their bits.
    let mut running: BinaryHeap<Reverse<(u64, usize, u64)>> = BinaryHeap::new();
    let mut now = 0.0f64;
    for (number, cycles) in cycles.enumerate().take(next + 1) {
        if running.len() == held
            && let Some(Reverse((end, ..))) = running.pop()
        {
            now = f64::from_bits(end);
        }
        if number < next {
            running.push(Reverse(((now + cycles).to_bits(), number, now.to_bits())));
        }
    }
    let mut all: Vec<(usize, f64)> =
        running.into_iter().map(|Reverse((_, number, begin))| (number, now - f64::from_bits(begin))).collect();
    all.sort_unstable_by_key(|&(number, _)| number);
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_long_block_makes_the_others_wait() {
        let scheduler = Scheduler { sms: 2, slots: 1, by_itself: 1.0 };
        assert_eq!(scheduler.run([1.0, 1.0, 1.0, 5.0].into_iter()), (6.0, 4.0));
        assert_eq!(scheduler.run([5.0, 1.0, 1.0, 1.0].into_iter()), (5.0, 4.0));
        assert_eq!(scheduler.run(std::iter::empty()), (0.0, 0.0));
    }

    #[test]
    fn a_block_is_slow_in_company_and_fast_by_itself() {
        // Two until the shorter is done at 4, then the other by itself at twice the speed.
        let scheduler = Scheduler { sms: 1, slots: 2, by_itself: 0.5 };
        assert_eq!(scheduler.run([4.0, 10.0].into_iter()), (7.0, 7.0));
        // A third comes at 4: two until 8, then one.
        assert_eq!(scheduler.run([4.0, 10.0, 4.0].into_iter()), (9.0, 9.0));
    }

    #[test]
    fn long_blocks_are_at_work_for_long() {
        let cycles = || [9.0, 1.0, 2.0, 4.0, 1.0].into_iter();
        assert_eq!(at_work(2, cycles(), 4), [(0, 7.0)]);
        assert_eq!(at_work(2, cycles(), 3), [(0, 3.0)]);
        assert_eq!(at_work(3, cycles(), 4), [(0, 2.0), (3, 1.0)]);
        assert_eq!(at_work(3, cycles(), 2), [(0, 0.0), (1, 0.0)]);
    }
}
