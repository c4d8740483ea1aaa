// Nodes of 32 bytes: planes in 8 bits, on a grid that each node has for itself (Mahovsky and Wyvill 2006; with a
// power of two as the grid's step, Ylitie et al. 2017, section 3.1). bvh/quantise.rs encodes; boxes only grow.
//
// Planes are multiples of the step below 2^24, so decoding rounds nothing: fused or not, it gives the same bits.
// Nodes come in depth-first order and so do leaves, which makes one number enough for the links of both children.
#ifndef QUANTISED_GLSL
#define QUANTISED_GLSL
#include "types.glsl"

vec4 decode_planes(uint bytes, float origin, uint exponent) {
    uvec4 steps = uvec4(bytes, bytes >> 8, bytes >> 16, bytes >> 24) & 255u;
    return vec4(steps) * uintBitsToFloat((exponent & 255u) << 23) + origin;
}

uvec2 decode_children(uint i, QuantisedNode node) {
    uint kind0 = (node.exponents >> QUANTISED_KIND0_SHIFT) & QUANTISED_INNER;
    uint kind1 = node.exponents >> QUANTISED_KIND1_SHIFT;
    bool inner0 = kind0 == QUANTISED_INNER, inner1 = kind1 == QUANTISED_INNER;
    uint child0 = inner0 ? i + 1u : LEAF_BIT | kind0 << LEAF_COUNT_SHIFT | node.base;
    uint child1 = inner1 ? (inner0 ? node.base : i + 1u)
                         : LEAF_BIT | kind1 << LEAF_COUNT_SHIFT | (node.base + (inner0 ? 0u : kind0));
    return uvec2(child0, child1);
}

// Node i, without parent and level.
Node decode_node(uint i, QuantisedNode node) {
    return Node(decode_planes(node.x, node.origin.x, node.exponents), decode_planes(node.y, node.origin.y, node.exponents >> 8),
                decode_planes(node.z, node.origin.z, node.exponents >> 16), decode_children(i, node), 0u, 0u);
}
#endif
