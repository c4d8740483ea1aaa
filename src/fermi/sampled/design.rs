//! Which multiprocessors to replay, and where to look at all of them.

use super::schedule::at_work;
use super::work::Block;
use crate::scene::procedural::random::Random;

/// A launch of which some multiprocessors are replayed.
#[derive(Clone, Debug)]
pub(super) struct Design {
    /// Each block.
    pub(super) work: Vec<Block>,
    /// Multiprocessors of the machine.
    pub(super) sms: usize,
    /// Blocks that each holds.
    pub(super) slots: usize,
    seed: u64,
}

/// Waves of a launch below which its beginning and end are too much of it for a sample from its middle.
const LEAST_WAVES: usize = 3;

impl Design {
    /// Of a machine whose `sms` multiprocessors hold `slots` blocks each.
    pub(super) fn new(work: Vec<Block>, (sms, slots): (usize, usize), seed: u64) -> Design {
        Design { work, sms, slots, seed }
    }

    pub(super) fn blocks(&self) -> usize {
        self.work.len()
    }

    /// Most multiprocessors whose replay is worth it; the full replay takes two passes over all, as each takes over one.
    pub(super) fn most_sms(&self) -> usize {
        if self.blocks() < LEAST_WAVES * self.sms * self.slots { 0 } else { self.sms / 2 }
    }

    /// Blocks of the multiprocessor drawn as number `draw`: one at random of each `sms` that are launched one after the
    /// other, as the block scheduler spreads them. No block is drawn twice.
    pub(super) fn blocks_of(&self, draw: usize) -> Vec<usize> {
        let of_group = |first: usize| {
            let mut random = Random::stream(self.seed, first as u64);
            let mut places: Vec<usize> = (first..first + self.sms).collect();
            // The first steps of a shuffle (Knuth, The Art of Computer Programming, volume 2, section 3.4.2).
            for place in 0..=draw {
                places.swap(place, place + (random.bits() % (self.sms - place) as u64) as usize);
            }
            places[draw]
        };
        let groups = (0..self.blocks()).step_by(self.sms);
        groups.map(of_group).filter(|&block| block < self.blocks()).collect()
    }

    /// Where to look in draw number `draw`: the blocks that are at work then, followed by those that come next; and for how
    /// many cycles, taken alone, those at work have run. `weights` are pairs of a block and its chance to be amid its run
    /// then, as a sum with those before it; there is at least one.
    pub(super) fn glimpse(&self, draw: usize, weights: &[(usize, f64)]) -> (Vec<usize>, Vec<f64>) {
        let total = weights.last().map_or(0.0, |&(_, sum)| sum);
        let place = f64::from(Random::stream(!self.seed, draw as u64).unit()) * total;
        let drawn = weights.partition_point(|&(_, sum)| sum <= place).min(weights.len() - 1);
        let held = self.sms * self.slots;
        let next = (weights[drawn].0 + held / 2).max(held).min(self.blocks());
        let (at_work, run): (Vec<usize>, _) =
            at_work(held, self.work.iter().map(|block| block.alone), next).into_iter().unzip();
        ([at_work, (next..self.blocks()).collect()].concat(), run)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Blocks of these costs alone.
    fn design(alone: impl Iterator<Item = f64>) -> Design {
        Design::new(alone.map(|alone| Block { alone, ..Block::default() }).collect(), (5, 2), 1)
    }

    #[test]
    fn multiprocessors_share_the_blocks_of_each_group() {
        let design = design((0..52).map(|_| 1.0));
        let mut all: Vec<usize> = (0..5).flat_map(|draw| design.blocks_of(draw)).collect();
        all.sort_unstable();
        assert_eq!(all, Vec::from_iter(0..52));
        assert!(design.blocks_of(2).windows(2).all(|pair| pair[1] / 5 == pair[0] / 5 + 1));
        assert_ne!(design.blocks_of(0), (0..52).step_by(5).collect::<Vec<_>>());
    }

    #[test]
    fn glimpses_lie_where_the_weight_is() {
        let design = design((0..52).map(|_| 8.0));
        for draw in 0..20 {
            let (blocks, run) = design.glimpse(draw, &[(3, 0.0), (30, 1.0), (50, 1.0)]);
            assert_eq!((blocks, run), ((26..52).collect(), [vec![8.0; 4], vec![0.0; 5]].concat()));
        }
    }
}
