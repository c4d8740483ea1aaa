// The BVH by address: scenes may be larger than a storage-buffer binding.
//
// CPU_LANES (the `*_cpu.comp` kernels) reads texels, from the bindings NODE_TEXELS and TRIANGLE_TEXELS. lavapipe
// gathers other loads with a branch a lane and 64 bits at most, which took two thirds of the time; its texel fetch
// loads 128 bits a lane and transposes them. 1.2x to 1.3x on lavapipe 25. The addresses are not used then.
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

#ifdef NODE_TEXELS
layout(set = 0, binding = NODE_TEXELS) uniform usamplerBuffer node_texels;
layout(set = 0, binding = TRIANGLE_TEXELS) uniform usamplerBuffer triangle_texels;

#ifdef QUANTISED
QuantisedNode fetch_quantised(uint i) {
    uvec4 frame = texelFetch(node_texels, int(2u * i));
    uvec4 planes = texelFetch(node_texels, int(2u * i + 1u));
    return QuantisedNode(uintBitsToFloat(frame.xyz), frame.w, planes.x, planes.y, planes.z, planes.w);
}

Node load_node(Nodes nodes, uint i) { return decode_node(i, fetch_quantised(i)); }
uvec2 load_children(Nodes nodes, uint i) { return decode_children(i, fetch_quantised(i)); }
#else
Node fetch_node(usamplerBuffer texels, uint i) {
    int first = int(4u * i);
    vec4 x = uintBitsToFloat(texelFetch(texels, first));
    vec4 y = uintBitsToFloat(texelFetch(texels, first + 1));
    vec4 z = uintBitsToFloat(texelFetch(texels, first + 2));
    uvec4 links = texelFetch(texels, first + 3);
    return Node(x, y, z, links.xy, links.z, links.w);
}

Node load_node(Nodes nodes, uint i) { return fetch_node(node_texels, i); }

// Links of a node's children, its parent, and its level.
uvec4 load_links(Nodes nodes, uint i) { return texelFetch(node_texels, int(4u * i + 3u)); }
uvec2 load_children(Nodes nodes, uint i) { return load_links(nodes, i).xy; }
#endif

Triangle load_triangle(Triangles triangles, uint i) {
    int first = int(3u * i);
    uvec4 v0 = texelFetch(triangle_texels, first);
    uvec4 v1 = texelFetch(triangle_texels, first + 1);
    uvec4 v2 = texelFetch(triangle_texels, first + 2);
    return Triangle(uintBitsToFloat(v0.xyz), v0.w, uintBitsToFloat(v1.xyz), v1.w, uintBitsToFloat(v2.xyz), v2.w);
}
#else
#ifdef QUANTISED
Node load_node(Nodes nodes, uint i) { return decode_node(i, nodes.at[i]); }
uvec2 load_children(Nodes nodes, uint i) { return decode_children(i, nodes.at[i]); }
#else
Node load_node(Nodes nodes, uint i) { return nodes.at[i]; }
uvec4 load_links(Nodes nodes, uint i) { return uvec4(nodes.at[i].child, nodes.at[i].parent, nodes.at[i].level); }
uvec2 load_children(Nodes nodes, uint i) { return nodes.at[i].child; }
#endif
Triangle load_triangle(Triangles triangles, uint i) { return triangles.at[i]; }
#endif

#ifdef TOP_TEXELS
layout(set = 0, binding = TOP_TEXELS) uniform usamplerBuffer top_texels;
Node load_top_node(Nodes top, uint i) { return fetch_node(top_texels, i); }
uvec4 load_top_links(Nodes top, uint i) { return texelFetch(top_texels, int(4u * i + 3u)); }
#elif !defined(QUANTISED)
Node load_top_node(Nodes top, uint i) { return load_node(top, i); }
uvec4 load_top_links(Nodes top, uint i) { return load_links(top, i); }
#endif
#endif
