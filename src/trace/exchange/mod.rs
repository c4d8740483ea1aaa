//! Trees, rays and hits as files that other programs write: what the reference runs of a simulator traced, and
//! the traversal of their kernel.
//!
//! Little-endian throughout:
//!
//! | file | content |
//! |---|---|
//! | `.bvh` | u32 magic `0x31485642`, node count, triangle count, 0; 64 bytes a node; 48 bytes a triangle |
//! | `.rays` | 32 bytes a ray: f32 origin, t_min, direction, t_max |
//! | `.hits` | 16 bytes a ray: f32 t, i32 primitive or -1, f32 u, v |
//!
//! A node holds twelve f32 planes (x low, x high, y low, y high of child 0, the same of child 1, z low, z high of
//! child 0, of child 1) and two i32 children: an index, or the complement of `first << 4 | count` of a leaf. A
//! triangle holds f32 corner, i32 primitive, f32 edge, 0, f32 edge, 0.

mod cut;
mod read;
mod walk;

#[cfg(test)]
mod tests;

pub use read::{read_hits, read_rays, read_tree};
pub use walk::record_reference;

use crate::shared::{LEAF_BIT, LEAF_COUNT_SHIFT};

/// A tree from a file, checked: every node and triangle is reached once.
#[derive(Clone, Debug, PartialEq)]
pub struct Tree {
    /// Planes of both children of each node, in the order of the file.
    pub planes: Vec<[f32; 12]>,
    /// Links of both children, encoded as in [`crate::layout::Node::child`].
    pub children: Vec<[u32; 2]>,
    /// Triangles in traversal order.
    pub triangles: Vec<EdgeTriangle>,
}

/// A triangle as a corner and the edges to the other two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeTriangle {
    /// First corner.
    pub corner: [f32; 3],
    /// From it to the second and to the third.
    pub edges: [[f32; 3]; 2],
    /// Primitive id.
    pub prim: u32,
}

/// Link of a leaf.
fn leaf(first: u32, count: u32) -> u32 {
    LEAF_BIT | count << LEAF_COUNT_SHIFT | first
}
