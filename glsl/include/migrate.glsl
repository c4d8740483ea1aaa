// Rays at the subtrees' SMs: workgroup s is SM s, and goes through the queues of the subtrees that it owns
// (Zhu and Deng 2013, section IV.A). A ray whose next subtree has the same owner goes on at once. No
// workgroup waits for another: what is not done when the quota of steps is spent is left to the next round.
#ifdef HARDWARE_SM
#extension GL_NV_shader_sm_builtins : require
#endif
#include "top_tree.glsl"

layout(local_size_x_id = SPEC_WORKGROUP) in;

// The entries of an SM, and the invocation's place among them.
struct Share {
    uint sm;
    uint at;
    uint end;
    uint sms_left;
};

#ifdef HARDWARE_SM
// Workgroups ask which SM they are on, and take entries as they can. No workgroup may ever have run on some
// SM, so that who has finished his own queues goes on with the next SM's.
void next_entry(inout Share share) {
    Words shares = Words(push.shares), taken_of_sm = Words(push.taken_of_sm);
    bool looking = true;
    while (looking) {
        share.at = shares.at[share.sm] + atomicAdd(taken_of_sm.at[share.sm], 1u);
        share.end = shares.at[share.sm + 1u];
        looking = share.at >= share.end && share.sms_left > 1u;
        if (looking) {
            share.sms_left -= 1u;
            share.sm = share.sm + 1u < push.sms ? share.sm + 1u : 0u;
        }
    }
}

Share first_share() {
    Share share = Share(gl_SMIDNV % push.sms, 0u, 0u, push.sms);
    next_entry(share);
    return share;
}
#else
// Entries are dealt to invocations in turn: who takes which is the same on all devices.
void next_entry(inout Share share) { share.at += push.lanes; }

Share first_share() {
    Words shares = Words(push.shares);
    uint sm = gl_WorkGroupID.x;
    return Share(sm, shares.at[sm] + gl_LocalInvocationID.x, shares.at[sm + 1u], 1u);
}
#endif

// Puts a record back: into the queue of the subtree that the ray goes on to, or with its end.
void store(uint at, QueueEntry entry, uint i, Hit hit, Travel travel, RayCounters counted) {
    bool is_end = travel.subtree == LINK_DONE;
    hits[i] = is_end ? finished(hit) : hit;
    if (is_end) faults += uint(atomicExchange(travels[entry.ray].subtree, LINK_DONE) == LINK_DONE);
    else travels[entry.ray] = travel;
    if (COUNT) {
        counters[i] = sum(counters[i], counted);
        Visits(push.visits).at[at] = Visit(entry.ray, entry.subtree, travel.subtree, 1u, counted);
    }
    queue[at].subtree = travel.subtree;
    ended += uint(is_end);
    pushed += uint(!is_end);
}

// A lane whose ray goes on here, in another subtree of its SM, is waited for: lanes that take records one by one cost
// lavapipe 1.2x.
void main() {
    Share share = first_share();
    uint steps = 0u;
    while (share.at < share.end && !spent(steps)) {
        QueueEntry entry = queue[share.at];
        uint i = push.first + entry.ray;
        Ray ray = load_ray(i);
        BoxRay box = box_ray(ray, push.scene_low, push.scene_high);
        Shear shear = shear_of(ray.direction);
        Hit hit = load_hit(i);
        Travel travel = load_travel(entry.ray);
        RayCounters counted = NOTHING_COUNTED;
        if (RECORD) begin_steps(step_starts[i], counters[i]);
        taken += 1u;
        bool is_here = travel.subtree == entry.subtree;
        bool goes_on = is_here;
        Subtree subtree = load_subtree(entry.subtree);
        while (goes_on) {
            if (COUNT && travel.link == subtree.root) counted.subtrees += 1u;
            Cursor cursor =
                cursor_of_trail(Nodes(push.nodes), subtree.root, subtree.level, travel.link, travel.trail);
            travel.trail = trail_above(travel.trail, subtree.level);
            traverse(Nodes(push.nodes), Triangles(push.triangles), ray, box, shear, cursor, hit, counted, steps);
            if (cursor.link != LINK_DONE) {
                travel.trail =
                    trail_of_stack(Nodes(push.nodes), subtree.root, subtree.level, cursor, travel.trail);
                travel.link = cursor.link;
                goes_on = false;
                if (COUNT) counted.suspensions += 1u;
            } else {
                uint next = LINK_DONE;
                if (!ANY_HIT || hit.prim == NO_HIT) {
                    next = next_subtree(ray, box, hit.t, LINK_DONE, subtree.parent, SUBTREE_LINK | travel.subtree,
                                        travel.trail, counted, steps);
                }
                bool stays = false;
                if (next == LINK_DONE) {
                    travel = TRAVEL_DONE;
                } else {
                    subtree = load_subtree(subtree_of(next));
                    travel = Travel(travel.trail, subtree.root, subtree_of(next));
                    stays = subtree.owner == share.sm;
                }
                goes_on = stays && !spent(steps);
                if (COUNT) {
                    if (stays) counted.bypasses += 1u;
                    else if (next != LINK_DONE) counted.migrations += 1u;
                }
            }
        }
        if (is_here) store(share.at, entry, i, hit, travel, counted);
        else faults += 1u;
        next_entry(share);
    }
    add_to_round();
}
