#version 460
#extension GL_GOOGLE_include_directive : require
// Adds what a shadow ray brings to its path, if the ray arrived.
#include "frame.glsl"

layout(set = 0, binding = 1, std430) readonly buffer ShadowRays { Ray shadow_rays[]; };
layout(set = 0, binding = 2, std430) readonly buffer ShadowHits { Hit shadow_hits[]; };
layout(set = 0, binding = 3, std430) readonly buffer Contributions { Contribution contributions[]; };
layout(set = 0, binding = 4, std430) buffer Paths { Path paths[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= push.count || shadow_rays[i].t_max < 0.0 || shadow_hits[i].prim != NO_HIT) return;
    paths[i].radiance = paths[i].radiance + contributions[i].radiance;
}
