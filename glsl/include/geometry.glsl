// The BVH by address: scenes may be larger than a storage-buffer binding.
#ifndef GEOMETRY_GLSL
#define GEOMETRY_GLSL
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#include "types.glsl"

layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Nodes { Node at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Triangles { Triangle at[]; };
#endif
