//! Which stretches of a launch to replay.

use std::ops::Range;

use rayon::prelude::*;

use super::Source;
use crate::Result;
use crate::fermi::kernel::Kernel;
use crate::fermi::machine::Machine;
use crate::fermi::occupancy::launchable;
use crate::fermi::simt::LANES;
use crate::scene::procedural::random::Random;

/// Rays of a warp whose visits are counted beforehand.
const SCOUTS: usize = 8;

/// Visits that a ray costs without any: its warp loads rays and stores hits.
const ENTRY: u32 = 4;

/// Consecutive blocks that are drawn together.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stretch {
    pub(super) blocks: Range<usize>,
    /// Expected cost of its blocks, in visits.
    pub(super) size: f64,
}

/// A launch cut into stretches, and a rule by which they are drawn.
#[derive(Clone, Debug)]
pub(super) struct Design {
    /// Blocks that the machine holds. A stretch is that long, and as many before it are replayed without being
    /// counted: then those of other places have left when it begins, and the L2 holds what is near.
    pub(super) wave: usize,
    /// Expected cost of each block.
    pub(super) sizes: Vec<f64>,
    pub(super) stretches: Vec<Stretch>,
    /// Expected cost of all before each stretch, and of all.
    cumulative: Vec<f64>,
    /// Where in the launch draws begin, 0..1.
    offset: f64,
}

impl Design {
    pub(super) fn new(machine: &Machine, kernel: &Kernel, source: &(impl Source + Sync), seed: u64) -> Result<Design> {
        let empty = crate::trace::StepTrace::default();
        let probe = super::launch(kernel, super::workload(source, &empty));
        let wave = probe.slots(launchable(machine, &probe)?.blocks) * machine.sms as usize;
        let (threads, rays) = (kernel.threads as usize, source.rays());
        // A block stays as long as its longest ray.
        let size = |block: usize| {
            let first = block * threads;
            let scouts = (0..SCOUTS * threads / LANES).map(|k| first + (2 * k + 1) * LANES / (2 * SCOUTS));
            let visits = scouts.filter(|&ray| ray < rays).map(|ray| source.visits(ray)).max();
            f64::from(visits.unwrap_or(0) + ENTRY)
        };
        let sizes: Vec<f64> = (0..rays.div_ceil(threads)).into_par_iter().map(size).collect();
        Ok(Design::of(sizes, wave, seed))
    }

    /// Of blocks of these `sizes`, above 0.
    pub(super) fn of(sizes: Vec<f64>, wave: usize, seed: u64) -> Design {
        let stretches: Vec<Stretch> = (0..sizes.len())
            .step_by(wave)
            .map(|first| first..(first + wave).min(sizes.len()))
            .map(|blocks| Stretch { size: sizes[blocks.clone()].iter().sum(), blocks })
            .collect();
        let mut cumulative = vec![0.0];
        for stretch in &stretches {
            cumulative.push(cumulative[cumulative.len() - 1] + stretch.size);
        }
        let offset = f64::from(Random::new(seed).unit());
        Design { wave, sizes, stretches, cumulative, offset }
    }

    pub(super) fn blocks(&self) -> usize {
        self.sizes.len()
    }

    /// Most draws that cost less than one pass over the whole launch.
    pub(super) fn most_draws(&self) -> usize {
        self.blocks().saturating_sub(self.wave) / (2 * self.wave)
    }

    /// Whether this many draws cost less than one pass; the full replay takes two.
    pub(super) fn worthwhile(&self, draws: usize) -> bool {
        draws <= self.most_draws()
    }

    /// The stretch of draw number `draw`: one in proportion to size, the first 2^k draws at even distances along the
    /// launch (systematic sampling: Cochran 1977, section 8.1; in the order of van der Corput, so that more draws keep
    /// those before them).
    pub(super) fn draw(&self, draw: usize) -> usize {
        let place = (draw as u32).reverse_bits() as f64 / 2f64.powi(32);
        let at = (self.offset + place).fract() * self.cumulative[self.stretches.len()];
        self.cumulative.partition_point(|&before| before <= at).clamp(1, self.stretches.len()) - 1
    }
}

#[cfg(test)]
mod tests {
    use super::Design;

    #[test]
    fn draws_follow_size_and_earlier_ones_stay() {
        // One stretch of eight holds half of the size.
        let sizes: Vec<f64> = (0..80).map(|block| if block / 10 == 5 { 7.0 } else { 1.0 }).collect();
        for seed in 0..20 {
            let design = Design::of(sizes.clone(), 10, seed);
            let draws: Vec<usize> = (0..32).map(|draw| design.draw(draw)).collect();
            let dear = draws.iter().filter(|&&stretch| stretch == 5).count();
            assert!((15..=17).contains(&dear), "seed {seed}: {draws:?}");
        }
    }
}
