// Every ray's first walk of the top tree (Zhu and Deng 2013, section IV.A): its hit so far is a miss, its
// queue that of the first subtree that it meets.
#include "top_tree.glsl"
#include "batch.glsl"

layout(local_size_x = 32) in;

void main() {
    uint local = gl_GlobalInvocationID.x;
    if (local == 0u) batches[0] = batch_of(push.count, push.sms);
    if (local >= push.count) return;
    uint i = push.first + local;
    Ray ray = load_ray(i);
    RayCounters counted = NOTHING_COUNTED;
    uvec2 trail = uvec2(0u);
    uint next = LINK_DONE;
    if (RECORD) begin_steps(step_starts[i], counted);
    if (ray.t_max >= ray.t_min) {
        uint steps = 0u;
        BoxRay box = box_ray(ray, push.scene_low, push.scene_high);
        next = next_subtree(ray, box, ray.t_max, push.root, 0u, 0u, trail, counted, steps);
        pushed += uint(next != LINK_DONE);
        ended += uint(next == LINK_DONE);
    }
    hits[i] = Hit(ray.t_max, NO_HIT, 0.0, 0.0);
    if (COUNT) counters[i] = counted;
    uint subtree = next == LINK_DONE ? LINK_DONE : subtree_of(next);
    if (next != LINK_DONE) travels[local] = Travel(trail, load_subtree(subtree).root, subtree);
    queue[local] = QueueEntry(local, subtree);
    add_to_round();
}
