//! Twin of `random.glsl`: random numbers by hashing.

use glam::Vec2;

/// PCG hash (Jarzynski and Olano 2020).
#[inline]
pub fn pcg(v: u32) -> u32 {
    let state = v.wrapping_mul(747796405).wrapping_add(2891336453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277803737);
    (word >> 22) ^ word
}

fn unit_float(bits: u32) -> f32 {
    (bits >> 8) as f32 * 5.960_464_5e-8
}

fn dimension_hash(seed: u32, pixel: u32, dimension: u32) -> u32 {
    pcg(pcg(pixel.wrapping_add(pcg(seed))).wrapping_add(dimension))
}

/// One coordinate of sample `index`.
pub fn random1(seed: u32, pixel: u32, dimension: u32, index: u32) -> f32 {
    unit_float(dimension_hash(seed, pixel, dimension).wrapping_add(index.wrapping_mul(0x9E37_79B9)))
}

/// Two coordinates of sample `index`.
pub fn random2(seed: u32, pixel: u32, dimension: u32, index: u32) -> Vec2 {
    let x = dimension_hash(seed, pixel, dimension).wrapping_add(index.wrapping_mul(0xC13F_A9A9));
    let y = dimension_hash(seed, pixel, dimension + 1).wrapping_add(index.wrapping_mul(0x91E1_0DA6));
    Vec2::new(unit_float(x), unit_float(y))
}
