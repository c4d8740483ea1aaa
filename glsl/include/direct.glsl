// Strategy `direct`: one invocation a ray, the paper's "standard".
#include "trace.glsl"

layout(local_size_x = 32) in;

#ifdef CPU_LANES
// Starting an invocation costs as much as some nodes, so that a workgroup's go through a strip of rays.
uint take_ray() {
    uint taken = atomicAdd(next_ray[gl_WorkGroupID.x], 1u);
    return taken < push.strip ? gl_WorkGroupID.x * push.strip + taken : push.count;
}
#endif

void main() {
#ifdef CPU_LANES
    if (STEP_LIMIT == 0u) {
        trace_rays();
        return;
    }
#endif
    uint local = gl_GlobalInvocationID.x;
    if (local >= push.count) return;
    bool resuming = STEP_LIMIT != 0u && push.resume != 0u;
    if (resuming && travels[local].link == LINK_DONE) return;
    uint steps = 0u;
    trace_ray(local, local, resuming, steps);
}
