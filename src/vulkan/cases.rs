//! Operands for judging a device's arithmetic: random ones, and the hardest that exist.

use bytemuck::{Pod, Zeroable};

/// Operands of `a / b`, `sqrt(a)`, `fma(a, b, c)`, `a * b` and `a + c`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct Operands {
    pub a: f32,
    pub b: f32,
    pub c: f32,
}

/// About 20,000 cases, the same ones every time.
pub(super) fn cases() -> Vec<Operands> {
    let mut random = SplitMix(1);
    let mut cases: Vec<Operands> = (0..8192).map(|i| random_case(&mut random, i)).collect();
    cases.extend((0..8192).map(|_| hard_division(&mut random)));
    cases.extend(hard_square_roots());
    cases.extend(binade_ends());
    cases
}

fn random_case(random: &mut SplitMix, i: u32) -> Operands {
    // A third each: one binade, moderate exponents, all normal numbers.
    let exponents = [0, 60, 126][i as usize % 3];
    let (a, b) = (random.float(exponents), random.float(exponents));
    // Half of the time what rounding the product lost, otherwise something of the product's size.
    let c = if i.is_multiple_of(2) { -(a * b) } else { a * b * random.float(2) };
    Operands { a, b, c }
}

/// A quotient that lies as near as can be to the middle of two neighbours, where the smallest error
/// rounds the wrong way: `A * 2^25 = M * B - r` with M odd and of 25 bits and r small, so that
/// `A / B = M / 2^25 * (1 - r / (M * B))`.
fn hard_division(random: &mut SplitMix) -> Operands {
    loop {
        let b = (random.next() >> 40) as u32 | 0x80_0001; // 24 bits, odd
        let r = i64::from((random.next() >> 60) as u32 * 2 + 1) * if random.next() >> 63 == 0 { 1 } else { -1 };
        // Newton's iteration doubles the correct low bits of an inverse; b is its own to 3 bits.
        let inverse = (0..4).fold(b, |x, _| x.wrapping_mul(2u32.wrapping_sub(b.wrapping_mul(x))));
        let m = (inverse as i64).wrapping_mul(r) & ((1 << 25) - 1);
        let a = (m * i64::from(b) - r) >> 25;
        if m >= 1 << 24 && a < 1 << 24 {
            let c = -random.float(10);
            return Operands { a: a as f32, b: b as f32, c };
        }
    }
}

/// Square roots as near as can be to the middle of two neighbours: `X * 2^k = M^2 - r` with M odd and
/// of 25 bits; roots of r modulo 2^k are lifted bit by bit (Hensel).
fn hard_square_roots() -> Vec<Operands> {
    let mut cases = Vec::new();
    for (r, k) in (-512i64..512).flat_map(|i| [(8 * i + 1, 25u32), (8 * i + 1, 26)]) {
        let lift = |root: i64, bit: u32| root + (((root * root - r) >> bit & 1) << (bit - 1));
        let root = (3..k).fold(1, lift);
        let half = 1 << (k - 1);
        for m in [root, -root, root + half, half - root].map(|m| m & ((1 << k) - 1)) {
            let x = (m * m - r) >> k;
            if (1 << 24..1 << 25).contains(&m) && x > 0 && x < 1 << 24 {
                // An odd k needs an odd exponent, so that the root's scale is a power of two.
                let a = x as f32 * if k.is_multiple_of(2) { 1.0 } else { 2.0 };
                cases.push(Operands { a, b: 1.0, c: 0.0 });
            }
        }
    }
    cases
}

/// The smallest and largest mantissas of two binades, where reciprocals and square roots are hardest.
fn binade_ends() -> impl Iterator<Item = Operands> {
    let mantissas = (0..256).chain((1 << 23) - 256..1 << 23);
    mantissas.flat_map(|mantissa| [127u32, 128].map(|exponent| f32::from_bits(exponent << 23 | mantissa))).map(|x| {
        let square = x * x;
        Operands { a: x, b: x, c: -square }
    })
}

/// SplitMix64 (Steele, Lea, Flood 2014).
struct SplitMix(u64);

impl SplitMix {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// A normal number of either sign with an exponent in `-limit..=limit`.
    fn float(&mut self, limit: u32) -> f32 {
        let bits = self.next();
        let exponent = 127 - limit + (bits >> 32) as u32 % (2 * limit + 1);
        f32::from_bits((bits as u32 & 0x807F_FFFF) | exponent << 23)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Distance of `x` from the middle of its two f32 neighbours, in units of their distance.
    fn distance_from_middle(x: f64) -> f64 {
        let rounded = x as f32;
        let ulp = f64::from(rounded.next_up()) - f64::from(rounded);
        0.5 - ((x - f64::from(rounded)) / ulp).abs()
    }

    #[test]
    fn hard_quotients_and_roots_are_near_a_middle() {
        let mut random = SplitMix(7);
        for _ in 0..1000 {
            let case = hard_division(&mut random);
            let distance = distance_from_middle(f64::from(case.a) / f64::from(case.b));
            assert!(distance.abs() < 1e-5, "{case:?}: {distance}");
        }
        let roots = hard_square_roots();
        assert!(roots.len() > 1500, "only {} roots", roots.len());
        for case in roots {
            let distance = distance_from_middle(f64::from(case.a).sqrt());
            assert!(distance.abs() < 1e-3, "{case:?}: {distance}");
        }
    }
}
