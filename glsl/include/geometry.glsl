// The BVH by address: scenes may be larger than a storage-buffer binding.
//
// CPU_LANES (the `*_cpu.comp` kernels) reads 64 bits at a time: a software driver turns each load into a
// gather over its lanes, whose cost is by the lane and not by the byte. 1.29x on lavapipe 25, where gathers
// of nodes took half of the time. GPUs load 16 bytes either way, and not all drivers have 64-bit integers.
#ifndef GEOMETRY_GLSL
#define GEOMETRY_GLSL
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#include "types.glsl"

#ifdef CPU_LANES
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require

struct NodeWords {
    u64vec2 x;
    u64vec2 y;
    u64vec2 z;
    uint64_t child;
    uint64_t parent; // and level
};
struct TriangleWords {
    u64vec2 v0;
    u64vec2 v1;
    u64vec2 v2;
};

layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Nodes { NodeWords at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Triangles { TriangleWords at[]; };

vec4 floats(u64vec2 words) { return uintBitsToFloat(uvec4(unpackUint2x32(words.x), unpackUint2x32(words.y))); }

Node load_node(Nodes nodes, uint i) {
    NodeWords node = nodes.at[i];
    return Node(floats(node.x), floats(node.y), floats(node.z), unpackUint2x32(node.child), 0u, 0u);
}

Triangle load_triangle(Triangles triangles, uint i) {
    TriangleWords triangle = triangles.at[i];
    vec4 v0 = floats(triangle.v0), v1 = floats(triangle.v1), v2 = floats(triangle.v2);
    return Triangle(v0.xyz, floatBitsToUint(v0.w), v1.xyz, 0u, v2.xyz, 0u);
}
#else
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Nodes { Node at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Triangles { Triangle at[]; };

Node load_node(Nodes nodes, uint i) { return nodes.at[i]; }
Triangle load_triangle(Triangles triangles, uint i) { return triangles.at[i]; }
#endif

// Parent and level of a node.
uvec2 load_place(Nodes nodes, uint i) {
#ifdef CPU_LANES
    return unpackUint2x32(nodes.at[i].parent);
#else
    return uvec2(nodes.at[i].parent, nodes.at[i].level);
#endif
}

// Links of a node's children.
uvec2 load_children(Nodes nodes, uint i) {
#ifdef CPU_LANES
    return unpackUint2x32(nodes.at[i].child);
#else
    return nodes.at[i].child;
#endif
}
#endif
