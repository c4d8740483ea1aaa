//! Seeded random numbers that are the same on every machine: integers, multiplication and square
//! root only, no libm.

use glam::Vec3;

/// SplitMix64 (Steele, Lea, Flood 2014): one 64-bit word of state, any seed is a good seed.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// The stream of this seed.
    pub fn new(seed: u64) -> Self {
        Random(seed)
    }

    /// An independent stream for part `index` of the scene, so that parts do not shift each other.
    pub fn stream(seed: u64, index: u64) -> Self {
        Random(mix(seed ^ mix(index.wrapping_add(GOLDEN_GAMMA))))
    }

    /// Uniform 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(GOLDEN_GAMMA);
        mix(self.0)
    }

    /// Uniform in 0..1 (never 1), a multiple of 2^-24 and so exact in f32.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 * (1.0 / 16_777_216.0)
    }

    /// Uniform in `low..high`.
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// An element of a slice that is not empty.
    pub fn pick<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[(self.bits() % choices.len() as u64) as usize]
    }

    /// Uniform in the cube -1..1.
    pub fn in_cube(&mut self) -> Vec3 {
        Vec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0))
    }

    /// Uniform in the unit ball less a grain at its centre, by rejection.
    pub fn in_ball(&mut self) -> Vec3 {
        loop {
            let point = self.in_cube();
            let square = point.length_squared();
            if square <= 1.0 && square > 1e-6 {
                return point;
            }
        }
    }

    /// Uniform unit vector.
    pub fn direction(&mut self) -> Vec3 {
        self.in_ball().normalize()
    }
}

const GOLDEN_GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

/// SplitMix64's finalizer: a bijection in which every input bit reaches every output bit.
pub fn mix(mut word: u64) -> u64 {
    word = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    word = (word ^ (word >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    word ^ (word >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matches_the_published_sequence() {
        // First outputs of SplitMix64 with seed 1234567, as published with the reference code.
        let mut random = Random::new(1_234_567);
        assert_eq!([random.bits(), random.bits()], [6_457_827_717_110_365_317, 3_203_168_211_198_807_973]);
    }

    #[test]
    fn unit_stays_below_one_and_spreads() {
        let mut random = Random::new(7);
        let values: Vec<f32> = (0..10_000).map(|_| random.unit()).collect();
        assert!(values.iter().all(|v| (0.0..1.0).contains(v)));
        let mean = values.iter().sum::<f32>() / 10_000.0;
        assert!((mean - 0.5).abs() < 0.02, "mean {mean}");
    }

    #[test]
    fn streams_differ() {
        assert_ne!(Random::stream(1, 0).bits(), Random::stream(1, 1).bits());
        assert_ne!(Random::stream(1, 0).bits(), Random::stream(2, 0).bits());
    }
}
