// Strategy `direct`: one invocation a ray, the paper's "standard".
#include "trace.glsl"

layout(local_size_x = 32) in;

void main() {
    uint local = gl_GlobalInvocationID.x;
    if (local >= push.count) return;
    bool resuming = STEP_LIMIT != 0u && push.resume != 0u;
    if (resuming && travels[local].link == LINK_DONE) return;
    uint steps = 0u;
    trace_ray(local, local, resuming, steps);
}
