//! Boxes that differ, for a builder that is weak on ties: PLOC merges nodes that are each other's nearest (Meister
//! and Bittner 2018), and of equally near ones obvhs takes the last. On a regular grid all nodes of a row then
//! choose their right neighbour, of which only the last pair is mutual, and the tree becomes a chain.

use obvhs::aabb::Aabb;
use rayon::prelude::*;

/// Most that a box grows on each side, relative to its size: far above rounding, far below what the surface
/// area heuristic notices. 2^-10.
const GROWTH: f32 = 9.765625e-4;

/// The boxes, each grown by another amount.
pub fn untied(boxes: &[Aabb]) -> Vec<Aabb> {
    let grown = |(index, aabb): (usize, &Aabb)| {
        let growth = aabb.diagonal() * (GROWTH * spread(index as u32));
        Aabb::new(aabb.min - growth, aabb.max + growth)
    };
    boxes.par_iter().enumerate().map(grown).collect()
}

/// Numbers in 0 .. 1, no two alike: the fractions of multiples of the golden ratio (Knuth, The Art of Computer
/// Programming 3, section 6.4).
fn spread(index: u32) -> f32 {
    index.wrapping_mul(0x9E37_79B9) as f32 / u32::MAX as f32
}
