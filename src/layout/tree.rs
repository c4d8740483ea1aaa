//! The BVH and its subtrees.

shared! {
    /// Two-child node, 64 bytes: the boxes of both children and where they are. Each axis holds
    /// `[child 0 low, child 0 high, child 1 low, child 1 high]`, so a node is four 16-byte loads and both
    /// boxes are tested by the same four-lane arithmetic.
    struct Node {
        /// x planes.
        x: [f32; 4],
        /// y planes.
        y: [f32; 4],
        /// z planes.
        z: [f32; 4],
        /// Links of both children; see [`crate::shared::LEAF_BIT`] for the encoding.
        child: [u32; 2],
        /// Index of the parent; the root's own.
        parent: u32,
        /// Inner nodes above this one.
        level: u32,
    }

    /// Node of 32 bytes whose planes are bytes; `glsl/include/quantised.glsl` says how it is read.
    struct QuantisedNode {
        /// Where the node's grid begins.
        origin: [f32; 3],
        /// Biased exponents of the grid's steps in x, y and z, a byte each; then 4 bits a child: its triangle count, or
        /// [`crate::shared::QUANTISED_INNER`].
        exponents: u32,
        /// x planes in steps from the origin, a byte each, in the order of [`Node`].
        x: u32,
        /// y planes.
        y: u32,
        /// z planes.
        z: u32,
        /// From which the links of both children follow.
        base: u32,
    }

    /// Triangle, 48 bytes, in traversal order: a leaf's triangles are adjacent.
    struct Triangle {
        /// First corner.
        v0: [f32; 3],
        /// Primitive id: index into the scene's triangles.
        prim: u32,
        /// Second corner.
        v1: [f32; 3],
        /// Zero.
        pad1: u32,
        /// Third corner.
        v2: [f32; 3],
        /// Zero.
        pad2: u32,
    }

    /// A part of the tree that one SM owns, 16 bytes.
    struct Subtree {
        /// Link of its root in the whole tree: a node or a leaf.
        root: u32,
        /// Index in the top tree of the node above it.
        parent: u32,
        /// Inner nodes above its root.
        level: u32,
        /// The SM that traverses it.
        owner: u32,
    }
}
