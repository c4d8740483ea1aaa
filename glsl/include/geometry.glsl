// The BVH by address: scenes may be larger than a storage-buffer binding.
//
// CPU_LANES (the `*_cpu.comp` kernels) reads texels, from the binding TREE_TEXELS: nodes, those of the top tree, subtrees,
// then triangles. lavapipe gathers other loads with a branch a lane and 64 bits at most, which took two thirds of the
// time; its texel fetch loads 128 bits a lane and transposes them. 1.2x to 1.3x on lavapipe 25. Of the addresses only
// the distance is used.
//
// With QUANTISED (the `*_quantised*.comp` kernels) nodes are those of quantised.glsl, decoded as they are loaded.
#ifndef GEOMETRY_GLSL
#define GEOMETRY_GLSL
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#include "types.glsl"

#ifdef QUANTISED
#include "quantised.glsl"
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Nodes { QuantisedNode at[]; };
#else
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Nodes { Node at[]; };
#endif
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Triangles { Triangle at[]; };

#ifdef TREE_TEXELS
layout(set = 0, binding = TREE_TEXELS) uniform usamplerBuffer tree_texels;

// A node's texels, or a triangle's and one more: as many loads whichever it is.
struct Texels {
    uvec4 at[4];
};

#ifdef QUANTISED
const uint NODE_TEXELS = 2u;
const uint MOST_TEXELS = 3u;
#else
const uint NODE_TEXELS = 4u;
const uint MOST_TEXELS = 4u;
#endif
const uint TRIANGLE_TEXELS = 3u;

uint node_texel(uint i) { return NODE_TEXELS * i; }
uint triangle_texel(Nodes nodes, Triangles triangles, uint i) {
    return (uvec2(triangles).x - uvec2(nodes).x) / TEXEL_BYTES + TRIANGLE_TEXELS * i;
}

Texels fetch_texels(usamplerBuffer texels, uint first) {
    Texels fetched;
    for (uint k = 0u; k < MOST_TEXELS; ++k) fetched.at[k] = texelFetch(texels, int(first + k));
    return fetched;
}

#ifdef QUANTISED
Node node_of(Texels texels, uint i) {
    uvec4 frame = texels.at[0], planes = texels.at[1];
    return decode_node(i, QuantisedNode(uintBitsToFloat(frame.xyz), frame.w, planes.x, planes.y, planes.z, planes.w));
}
#else
Node node_of(Texels texels, uint i) {
    uvec4 links = texels.at[3];
    return Node(uintBitsToFloat(texels.at[0]), uintBitsToFloat(texels.at[1]), uintBitsToFloat(texels.at[2]), links.xy,
                links.z, links.w);
}
Node load_node(Nodes nodes, uint i) { return node_of(fetch_texels(tree_texels, node_texel(i)), i); }
// Links of a node's children, its parent, and its level.
uvec4 load_links(Nodes nodes, uint i) { return texelFetch(tree_texels, int(node_texel(i) + 3u)); }
#endif

Triangle triangle_of(Texels texels) {
    return Triangle(uintBitsToFloat(texels.at[0].xyz), texels.at[0].w, uintBitsToFloat(texels.at[1].xyz), texels.at[1].w,
                    uintBitsToFloat(texels.at[2].xyz), texels.at[2].w);
}

#else
#ifdef QUANTISED
Node load_node(Nodes nodes, uint i) { return decode_node(i, nodes.at[i]); }
#else
Node load_node(Nodes nodes, uint i) { return nodes.at[i]; }
uvec4 load_links(Nodes nodes, uint i) { return uvec4(nodes.at[i].child, nodes.at[i].parent, nodes.at[i].level); }
#endif
Triangle load_triangle(Triangles triangles, uint i) { return triangles.at[i]; }
#endif

#ifdef QUANTISED
#ifdef TREE_TEXELS
uvec2 load_children(Nodes nodes, uint i) { return node_of(fetch_texels(tree_texels, node_texel(i)), i).child; }
#else
uvec2 load_children(Nodes nodes, uint i) { return decode_children(i, nodes.at[i]); }
#endif
#else
uvec2 load_children(Nodes nodes, uint i) { return load_links(nodes, i).xy; }
#endif

#endif
