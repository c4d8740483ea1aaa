//! Twin of `quantised.glsl`: from 32 bytes to a node.

use crate::layout::{Node, QuantisedNode};
use crate::shared::{LEAF_BIT, LEAF_COUNT_SHIFT, QUANTISED_INNER, QUANTISED_KIND0_SHIFT, QUANTISED_KIND1_SHIFT};

#[inline(always)]
fn decode_planes(bytes: u32, origin: f32, exponent: u32) -> [f32; 4] {
    let step = f32::from_bits((exponent & 255) << 23);
    bytes.to_le_bytes().map(|count| f32::from(count) * step + origin)
}

#[inline(always)]
fn decode_children(i: u32, node: &QuantisedNode) -> [u32; 2] {
    let kind0 = node.exponents >> QUANTISED_KIND0_SHIFT & QUANTISED_INNER;
    let kind1 = node.exponents >> QUANTISED_KIND1_SHIFT;
    let (inner0, inner1) = (kind0 == QUANTISED_INNER, kind1 == QUANTISED_INNER);
    let leaf = |count: u32, first: u32| LEAF_BIT | count << LEAF_COUNT_SHIFT | first;
    let child0 = if inner0 { i + 1 } else { leaf(kind0, node.base) };
    let child1 = match (inner0, inner1) {
        (true, true) => node.base,
        (false, true) => i + 1,
        (true, false) => leaf(kind1, node.base),
        (false, false) => leaf(kind1, node.base + kind0),
    };
    [child0, child1]
}

/// Node `i`, without parent and level.
#[inline(always)]
pub fn decode_node(i: u32, node: &QuantisedNode) -> Node {
    let e = node.exponents;
    Node {
        x: decode_planes(node.x, node.origin[0], e),
        y: decode_planes(node.y, node.origin[1], e >> 8),
        z: decode_planes(node.z, node.origin[2], e >> 16),
        child: decode_children(i, node),
        parent: 0,
        level: 0,
    }
}
