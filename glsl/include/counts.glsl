// Rays made, by kind: summed over the workgroup first, so that one atomic serves 32 rays. The includer
// defines RAY_COUNTS_BINDING and brackets its work with begin_counts and end_counts, in uniform control flow.
#ifndef COUNTS_GLSL
#define COUNTS_GLSL
#include "shared.glsl"

layout(set = 0, binding = RAY_COUNTS_BINDING, std430) buffer RayCounts { uint ray_counts[KINDS]; };

shared uint group_counts[KINDS];

void begin_counts() {
    if (gl_LocalInvocationIndex < KINDS) group_counts[gl_LocalInvocationIndex] = 0u;
    barrier();
}

void count_ray(uint kind) { atomicAdd(group_counts[kind], 1u); }

void end_counts() {
    barrier();
    uint kind = gl_LocalInvocationIndex;
    if (kind < KINDS && group_counts[kind] > 0u) atomicAdd(ray_counts[kind], group_counts[kind]);
}
#endif
