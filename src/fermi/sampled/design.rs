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
    /// Of all draws.
    pub(super) seed: u64,
}

/// What a multiprocessor has asked of the L2 when a block of it has ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct Asked {
    /// The block.
    pub(super) block: usize,
    /// Accesses of this block and all before it for lines of the tree and of stacks.
    pub(super) accesses: f64,
    /// Misses of any line.
    pub(super) misses: f64,
}

/// Clusters below which Student's interval is much wider than the normal one, and its width much a matter of chance.
const LEAST_CLUSTERS: usize = 20;

/// Multiples of it, modulo 1, lie as far apart as any number of points can (Knuth, The Art of Computer Programming,
/// volume 3, section 6.4): any first few of them are a stratified sample.
const GOLDEN_RATIO: f64 = 0.618_033_988_749_894_9;

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

    /// Multiprocessors to begin with.
    pub(super) fn first_sms(&self) -> usize {
        (LEAST_CLUSTERS * self.slots * self.sms).div_ceil(self.blocks().max(1))
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
    /// many cycles, taken alone, those at work have run. Places are drawn in proportion to accesses of the L2 in `course`,
    /// which is not empty; from where a glimpse begins to its place are `before` misses of the multiprocessor.
    pub(super) fn glimpse(&self, draw: usize, course: &[Asked], before: f64) -> (Vec<usize>, Vec<f64>) {
        let shift = f64::from(Random::stream(!self.seed, 0).unit());
        let place = (shift + draw as f64 * GOLDEN_RATIO).fract() * course.last().map_or(0.0, |last| last.accesses);
        let drawn = course.partition_point(|asked| asked.accesses <= place).min(course.len() - 1);
        let begin = course.partition_point(|asked| asked.misses < course[drawn].misses - before).min(drawn);
        let held = self.sms * self.slots;
        let next = (course[begin].block + held / 2).max(held).min(self.blocks());
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
    fn glimpses_lie_where_the_weight_is_and_begin_before() {
        let design = design((0..52).map(|_| 8.0));
        let course = [(3, 0.0, 1.0), (20, 0.0, 5.0), (30, 1.0, 9.0), (50, 1.0, 10.0)]
            .map(|(block, accesses, misses)| Asked { block, accesses, misses });
        for draw in 0..20 {
            for (before, next) in [(0.0, 35), (4.0, 25), (100.0, 10)] {
                let (blocks, run) = design.glimpse(draw, &course, before);
                // One of the ten has just ended.
                assert_eq!((blocks, run.len()), ((next - 9..52).collect(), 9), "{before}");
            }
        }
    }

    #[test]
    fn glimpses_are_spread_over_the_launch() {
        let design = design((0..520).map(|_| 8.0));
        let course: Vec<Asked> =
            (0..104).map(|i| Asked { block: 5 * i, accesses: (i + 1) as f64, misses: i as f64 }).collect();
        let mut places: Vec<usize> = (0..4).map(|draw| design.glimpse(draw, &course, 0.0).0[9]).collect();
        places.sort_unstable();
        assert!(places.windows(2).all(|pair| pair[1] - pair[0] > 520 / 8), "{places:?}");
    }

    #[test]
    fn a_launch_of_few_blocks_begins_with_more_multiprocessors() {
        let first = |blocks: usize| design((0..blocks).map(|_| 1.0)).first_sms();
        assert_eq!([100, 200, 201, 5000].map(first), [2, 1, 1, 1]);
    }
}
