// Strategy `persistent`: a fixed number of invocations take rays from a common counter until there are no
// more (Aila and Laine 2009, section 3.3), a subgroup's worth at a time.
#extension GL_KHR_shader_subgroup_ballot : require
#include "trace.glsl"

layout(local_size_x = 32) in;

// The next ray for each invocation of the subgroup that asks.
uint take_ray() {
    uvec4 asking = subgroupBallot(true);
    uint first = 0u;
    if (subgroupElect()) first = atomicAdd(next_ray, subgroupBallotBitCount(asking));
    return subgroupBroadcastFirst(first) + subgroupBallotExclusiveBitCount(asking);
}

void main() {
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
