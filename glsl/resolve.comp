#version 460
#extension GL_GOOGLE_include_directive : require
// Adds a sample to the film and, after the last one, divides by their number.
#include "frame.glsl"
#include "vec.glsl"

layout(set = 0, binding = 1, std430) readonly buffer Paths { Path paths[]; };
layout(set = 0, binding = 2, std430) buffer Film { vec4 film[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= push.count) return;
    bool covered = frame.transparent == 0u || (paths[i].state & PATH_COVERED) != 0u;
    vec4 sum = vec4(paths[i].radiance, covered ? 1.0 : 0.0);
    if (push.sample_index > 0u) sum = film[i] + sum;
    film[i] = push.argument != 0u ? sum * exact_rcp(float(frame.samples)) : sum;
}
