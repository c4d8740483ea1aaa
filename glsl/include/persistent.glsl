// Strategy `persistent`: a fixed number of invocations take rays from a common counter until there are no
// more (Aila and Laine 2009, section 3.3). Each takes one at a time and no subgroup operation is needed:
// compilers join the additions of a warp to one, so that its lanes get neighbouring rays.
#include "trace.glsl"

layout(local_size_x = 32) in;

uint take_ray() { return atomicAdd(next_ray[0], 1u); }

void main() {
#ifdef CPU_LANES
    if (STEP_LIMIT == 0u) {
        trace_rays();
        return;
    }
#endif
    uint slot = gl_GlobalInvocationID.x;
    uint steps = 0u;
    // Each invocation first goes on with the ray that it left.
    if (STEP_LIMIT != 0u && push.resume == 0u) travels[slot].link = LINK_DONE;
    bool resuming = STEP_LIMIT != 0u && travels[slot].link != LINK_DONE;
    uint local = resuming ? travels[slot].subtree : take_ray();
    bool working = local < push.count;
    while (working) {
        trace_ray(local, slot, resuming, steps);
        resuming = false;
        working = !spent(steps);
        if (working) {
            local = take_ray();
            working = local < push.count;
        }
    }
}
