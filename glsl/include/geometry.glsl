// The BVH by address: scenes may be larger than a storage-buffer binding.
//
// CPU_LANES (the `*_cpu.comp` kernels) reads texels, from the bindings NODE_TEXELS and TRIANGLE_TEXELS. lavapipe
// gathers other loads with a branch a lane and 64 bits at most, which took two thirds of the time; its texel fetch
// loads 128 bits a lane and transposes them. 1.2x to 1.3x on lavapipe 25. The addresses are not used then.
#ifndef GEOMETRY_GLSL
#define GEOMETRY_GLSL
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#include "types.glsl"

layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Nodes { Node at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Triangles { Triangle at[]; };

#ifdef CPU_LANES
layout(set = 0, binding = NODE_TEXELS) uniform usamplerBuffer node_texels;
layout(set = 0, binding = TRIANGLE_TEXELS) uniform usamplerBuffer triangle_texels;

Node load_node(Nodes nodes, uint i) {
    int first = int(4u * i);
    vec4 x = uintBitsToFloat(texelFetch(node_texels, first));
    vec4 y = uintBitsToFloat(texelFetch(node_texels, first + 1));
    vec4 z = uintBitsToFloat(texelFetch(node_texels, first + 2));
    return Node(x, y, z, texelFetch(node_texels, first + 3).xy, uvec2(0u));
}

Triangle load_triangle(Triangles triangles, uint i) {
    int first = int(3u * i);
    uvec4 v0 = texelFetch(triangle_texels, first);
    uvec4 v1 = texelFetch(triangle_texels, first + 1);
    uvec4 v2 = texelFetch(triangle_texels, first + 2);
    return Triangle(uintBitsToFloat(v0.xyz), v0.w, uintBitsToFloat(v1.xyz), v1.w, uintBitsToFloat(v2.xyz), v2.w);
}
#else
Node load_node(Nodes nodes, uint i) { return nodes.at[i]; }
Triangle load_triangle(Triangles triangles, uint i) { return triangles.at[i]; }
#endif
#endif
