//! Quantised nodes: boxes on a grid of 8 bits, 32 bytes a node where full nodes take 64.
//!
//! Each node has a grid of its own (Mahovsky and Wyvill 2006), whose step is a power of two (Ylitie et al. 2017,
//! section 3.1). Boxes grow to the grid: no ray misses a box that it met before, and hits stay the same.

use glam::Vec3;

use super::build::{Bvh, EMPTY_LEAF};
use super::statistics::child_bounds;
use crate::layout::{Node, QuantisedNode};
use crate::shared::{
    LEAF_BIT, LEAF_COUNT_MASK, LEAF_COUNT_SHIFT, LEAF_FIRST_MASK, QUANTISED_INNER, QUANTISED_KIND0_SHIFT,
    QUANTISED_KIND1_SHIFT,
};

/// Steps of a grid.
const STEPS: f64 = 255.0;

/// Planes are less than so many steps from zero: integers that a float holds exactly, 2^24.
const MOST_STEPS: f64 = 16_777_216.0;

/// Exponent of the finest step: coordinates are multiples of it, see [`crate::shared::COORDINATE_FLOOR`].
const FINEST: i32 = -63;

/// Bias of a float's exponent.
const BIAS: i32 = 127;

/// A BVH with quantised nodes; node `i` is node `i` of the full one.
#[derive(Clone, Debug)]
pub struct QuantisedBvh<'a> {
    /// Nodes.
    pub nodes: Vec<QuantisedNode>,
    /// Triangles and bounds.
    pub bvh: &'a Bvh,
}

impl<'a> QuantisedBvh<'a> {
    /// Encodes the nodes of `bvh`.
    pub fn new(bvh: &'a Bvh) -> QuantisedBvh<'a> {
        QuantisedBvh { nodes: bvh.nodes.iter().map(quantised).collect(), bvh }
    }
}

/// Where a node's grid begins on an axis, and the exponent of its step.
#[derive(Clone, Copy)]
struct Grid {
    origin: f64,
    exponent: i32,
}

impl Grid {
    /// The finest on which `low` and `high`, moved out to it, are in reach.
    fn of(low: f32, high: f32) -> Grid {
        let (low, high) = (f64::from(low), f64::from(high));
        let mut exponent = FINEST;
        loop {
            let step = 2f64.powi(exponent);
            let (first, last) = ((low / step).floor(), (high / step).ceil());
            if last - first <= STEPS && first.abs() + STEPS <= MOST_STEPS {
                return Grid { origin: first * step, exponent };
            }
            // Straight to the step that the extent asks for; from there on by one.
            let needed = ((high - low) / STEPS).max(low.abs() / MOST_STEPS).log2().floor() as i32;
            exponent = needed.max(exponent + 1);
        }
    }

    fn steps(self, plane: f32) -> f64 {
        (f64::from(plane) - self.origin) / 2f64.powi(self.exponent)
    }

    /// Steps of the planes of two boxes, the low ones moved down and the high ones up.
    fn bytes(self, [low0, high0, low1, high1]: [f32; 4]) -> u32 {
        let down = |plane: f32| self.steps(plane).floor() as u8;
        let up = |plane: f32| self.steps(plane).ceil() as u8;
        u32::from_le_bytes([down(low0), up(high0), down(low1), up(high1)])
    }
}

fn quantised(node: &Node) -> QuantisedNode {
    let mut full = *node;
    let (low, high) = cover(&mut full);
    let grids = [0, 1, 2].map(|k| Grid::of(low[k], high[k]));
    let (kinds, base) = links(node.child);
    let exponents = grids.iter().rev().fold(0, |word, grid| word << 8 | (grid.exponent + BIAS) as u32);
    QuantisedNode {
        origin: grids.map(|grid| grid.origin as f32),
        exponents: exponents | kinds[0] << QUANTISED_KIND0_SHIFT | kinds[1] << QUANTISED_KIND1_SHIFT,
        x: grids[0].bytes(full.x),
        y: grids[1].bytes(full.y),
        z: grids[2].bytes(full.z),
        base,
    }
}

/// The box of both children. A missing child, which no ray meets, becomes a point of it: what meets that finds an
/// empty leaf.
fn cover(node: &mut Node) -> (Vec3, Vec3) {
    let boxes = [0, 1].map(|side| (node.child[side] != EMPTY_LEAF).then(|| child_bounds(node, side)));
    let union = |a: (Vec3, Vec3), b: (Vec3, Vec3)| (a.0.min(b.0), a.1.max(b.1));
    let cover = boxes.into_iter().flatten().reduce(union).unwrap_or_default();
    for side in (0..2).filter(|&side| boxes[side].is_none()) {
        for (planes, k) in [&mut node.x, &mut node.y, &mut node.z].into_iter().zip(0..) {
            planes[2 * side..2 * side + 2].fill(cover.0[k]);
        }
    }
    cover
}

/// Kinds of both children, and the one number from which their links follow: the second child's if both are inner
/// nodes, else the first triangle of the first leaf.
fn links(child: [u32; 2]) -> ([u32; 2], u32) {
    let is_leaf = |link: u32| link & LEAF_BIT != 0;
    let kind = |link: u32| if is_leaf(link) { link >> LEAF_COUNT_SHIFT & LEAF_COUNT_MASK } else { QUANTISED_INNER };
    let base = match child.into_iter().find(|&link| is_leaf(link)) {
        Some(leaf) => leaf & LEAF_FIRST_MASK,
        None => child[1],
    };
    (child.map(kind), base)
}
