//! Boxes that differ, for a builder that is weak on ties: PLOC merges nodes that are each other's nearest (Meister
//! and Bittner 2018), and of equally near ones obvhs takes the last. On a regular grid all nodes of a row then
//! choose their right neighbour, of which only the last pair is mutual, and the tree becomes a chain.

use glam::Vec3A;
use obvhs::aabb::Aabb;
use rayon::prelude::*;

/// Most that a box grows on each side, relative to its size: far above rounding, far below what the surface
/// area heuristic notices. 2^-10.
const GROWTH: f32 = 9.765625e-4;

/// The boxes, each grown by another amount, and moved near the origin: far from it rounding would tie them again.
pub fn untied(boxes: &[Aabb]) -> Vec<Aabb> {
    let shift = shift_to_origin(&boxes.par_iter().copied().reduce(Aabb::empty, |a, b| a.union(&b)));
    let grown = |(index, aabb): (usize, &Aabb)| {
        let growth = aabb.diagonal() * (GROWTH * spread(index as u32));
        Aabb::new(aabb.min - shift - growth, aabb.max - shift + growth)
    };
    boxes.par_iter().enumerate().map(grown).collect()
}

/// Whole sizes of the scene from the origin to its middle: none for a scene that reaches to the origin.
fn shift_to_origin(scene: &Aabb) -> Vec3A {
    let size = scene.diagonal().max_element();
    if size > 0.0 { (scene.center() / size).trunc() * size } else { scene.min }
}

/// Numbers in 0 .. 1, no two alike: the fractions of multiples of the golden ratio (Knuth, The Art of Computer
/// Programming 3, section 6.4).
fn spread(index: u32) -> f32 {
    index.wrapping_mul(0x9E37_79B9) as f32 / u32::MAX as f32
}
