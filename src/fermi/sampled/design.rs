//! Which stretches of a launch to replay.

use std::ops::Range;

use super::work::Block;
use crate::scene::procedural::random::Random;

/// Consecutive blocks that are drawn together.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stretch {
    pub(super) blocks: Range<usize>,
    /// What they cost alone.
    pub(super) alone: f64,
}

/// A launch cut into stretches, and a rule by which they are drawn.
#[derive(Clone, Debug)]
pub(super) struct Design {
    /// Blocks that the machine holds.
    pub(super) wave: usize,
    /// Each block.
    pub(super) work: Vec<Block>,
    pub(super) stretches: Vec<Stretch>,
    /// Cost of all before each stretch, and of all.
    cumulative: Vec<f64>,
    seed: u64,
}

impl Design {
    pub(super) fn new(work: Vec<Block>, wave: usize, seed: u64) -> Design {
        // The blocks of half a wave are as alike as those of a whole one, and cost half of it.
        let length = wave.div_ceil(2);
        let stretches: Vec<Stretch> = (0..work.len())
            .step_by(length)
            .map(|first| first..(first + length).min(work.len()))
            .map(|blocks| Stretch { alone: work[blocks.clone()].iter().map(|block| block.alone).sum(), blocks })
            .collect();
        let mut cumulative = vec![0.0];
        for stretch in &stretches {
            cumulative.push(cumulative[cumulative.len() - 1] + stretch.alone);
        }
        Design { wave, work, stretches, cumulative, seed }
    }

    pub(super) fn blocks(&self) -> usize {
        self.work.len()
    }

    /// Blocks before a stretch that are replayed with it and not counted: with those of other places that are still at
    /// work they fill the machine, and the caches hold what is near when the stretch begins.
    pub(super) fn before(&self) -> usize {
        self.wave.div_ceil(2)
    }

    /// Most draws that cost less than one pass over the whole launch; the full replay takes two.
    pub(super) fn most_draws(&self) -> usize {
        self.blocks().saturating_sub(self.wave) / (2 * self.before())
    }

    /// The stretch of draw number `draw`: each draw by itself, in proportion to cost (Hansen and Hurwitz 1943), so that
    /// stretches differ as chance has it, whatever order the launch has.
    pub(super) fn draw(&self, draw: usize) -> usize {
        let place = f64::from(Random::stream(self.seed, draw as u64).unit()) * self.cumulative[self.stretches.len()];
        self.cumulative.partition_point(|&before| before <= place).clamp(1, self.stretches.len()) - 1
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Blocks of these costs alone.
    pub fn blocks(alone: impl Iterator<Item = f64>) -> Vec<Block> {
        alone.map(|alone| Block { alone, ..Block::default() }).collect()
    }

    #[test]
    fn draws_follow_cost() {
        // One stretch of eight holds half of the cost.
        let design = Design::new(blocks((0..80).map(|block| if block / 10 == 5 { 7.0 } else { 1.0 })), 20, 1);
        let dear = (0..1000).filter(|&draw| design.draw(draw) == 5).count();
        assert!((450..=550).contains(&dear), "{dear} of 1000");
    }
}
