//! The memory layout of nodes and triangles, shared with `glsl/include/types.glsl`.

use bytemuck::{Pod, Zeroable};

/// Two-child node, 64 bytes: the boxes of both children and where they are.
///
/// Each axis holds `[child 0 low, child 0 high, child 1 low, child 1 high]`, so a node is four 16-byte
/// loads and both boxes are tested by the same four-lane arithmetic.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Node {
    /// x planes.
    pub x: [f32; 4],
    /// y planes.
    pub y: [f32; 4],
    /// z planes.
    pub z: [f32; 4],
    /// Links of both children; see [`crate::shared::LEAF_BIT`] for the encoding.
    pub child: [u32; 2],
    /// Zero.
    pub pad: [u32; 2],
}

/// Triangle, 48 bytes, in traversal order: a leaf's triangles are adjacent.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Triangle {
    /// First corner.
    pub v0: [f32; 3],
    /// Primitive id: index into the scene's triangles.
    pub prim: u32,
    /// Second corner.
    pub v1: [f32; 3],
    /// Zero.
    pub pad1: u32,
    /// Third corner.
    pub v2: [f32; 3],
    /// Zero.
    pub pad2: u32,
}
