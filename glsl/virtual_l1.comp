#version 460
#extension GL_GOOGLE_include_directive : require
// Strategy `direct` as a Fermi would run it, to count accesses of the L1: workgroup s is SM s and one warp wide. It
// goes through its resident warps in turn, one block of code with memory instructions each; their lanes go
// while-while in lockstep and reconverge where the loops end. `fermi::lockstep` counts the same from step traces.
//
// A lane's stack is where local memory has it: entries of all resident threads side by side, the end marker first.
#include "traverse.glsl"
#include "virtual_cache.glsl"

layout(local_size_x = 32) in;

layout(set = 0, binding = 0, std430) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 1, std430) buffer Hits { Hit hits[]; };
layout(set = 0, binding = 2, std430) buffer Cursors { uvec2 cursors[]; }; // link and depth of each thread
layout(set = 0, binding = 3, std430) buffer Stacks { uint stacks[]; };
layout(set = 0, binding = 4, std430) buffer Slots { WarpSlot slots[]; };
layout(set = 0, binding = 5, std430) buffer Lines { uint lines[]; }; // of each SM's L1
layout(set = 0, binding = 6, std430) buffer Counts { AccessCounts counts[]; }; // [SM * ACCESS_KINDS + kind]

layout(push_constant, std430) uniform VirtualPush {
    uvec2 nodes;
    uvec2 triangles;
    vec3 scene_low;
    uint turn;
    vec3 scene_high;
    uint count;
    uint node_line;
    uint triangle_line;
    uint ray_line;
    uint hit_line;
    uint stack_line;
    uint sms;
    uint warps;
    uint sets;
    uint ways;
    uint hashed;
} push;

const uint PHASE_ENTRY = 0u, PHASE_NODES = 1u, PHASE_LEAVES = 2u, PHASE_EXIT = 3u;
// Memory instructions of a block at most: three a triangle, and a pop.
const uint LEAF_INSTRUCTIONS = 3u * MAX_LEAF_TRIANGLES + 1u;
// Loads of 16 bytes in a line.
const uint LOADS = 8u;

shared WarpSlot resident[VIRTUAL_WARPS];
// Some lane stands at a node, at a leaf.
shared uint any_node, any_leaf;

// What a lane did in its turn, as far as memory is concerned.
struct Turn {
    uint phase;
    bool taken;
    uint ray;
    uint thread;
    uint link;
    uint depth;
    bool met;
    bool met_both;
};

uint stack_at(Turn turn, uint depth) { return depth * push.sms * push.warps * WARP + turn.thread; }
uint stack_line(Turn turn, uint depth) { return push.stack_line + stack_at(turn, depth) / 32u; }

uint instructions_of(uint phase) {
    return phase == PHASE_ENTRY ? 3u : phase == PHASE_NODES ? 6u : phase == PHASE_LEAVES ? LEAF_INSTRUCTIONS : 1u;
}

uint kind_of(uint phase, uint k) {
    if (phase == PHASE_ENTRY) return k < 2u ? ACCESS_LOAD : ACCESS_PUSH;
    if (phase == PHASE_NODES) return k < 4u ? ACCESS_LOAD : k == 4u ? ACCESS_PUSH : ACCESS_POP;
    if (phase == PHASE_LEAVES) return k < LEAF_INSTRUCTIONS - 1u ? ACCESS_LOAD : ACCESS_POP;
    return ACCESS_STORE;
}

// The line that the k-th memory instruction of the lane's turn touches, if any.
uint line_of(Turn turn, uint k) {
    if (!turn.taken) return NO_LINE;
    if (turn.phase == PHASE_ENTRY) return k < 2u ? push.ray_line + (2u * turn.ray + k) / LOADS : stack_line(turn, 0u);
    if (turn.phase == PHASE_NODES) {
        // Four loads, the links only for who goes down; then a push or a pop.
        if (k < 3u || (k == 3u && turn.met)) return push.node_line + (4u * turn.link + k) / LOADS;
        if (k == 4u && turn.met_both) return stack_line(turn, turn.depth + 1u);
        return k == 5u && !turn.met ? stack_line(turn, turn.depth) : NO_LINE;
    }
    if (turn.phase == PHASE_LEAVES) {
        if (k == LEAF_INSTRUCTIONS - 1u) return stack_line(turn, turn.depth);
        uint triangles = leaf_count(turn.link), first = leaf_first(turn.link);
        return k / 3u < triangles ? push.triangle_line + (3u * first + k) / LOADS : NO_LINE;
    }
    return push.hit_line + turn.ray / LOADS;
}

uint popped(Turn turn, inout uint depth) {
    uint link = stacks[stack_at(turn, depth)];
    depth -= min(depth, 1u);
    return link;
}

// The lane's part in its warp's turn. Returns the link at which it then stands.
uint step_lane(inout Turn turn) {
    Ray ray = rays[turn.ray];
    uint link = turn.link, depth = turn.depth;
    if (turn.phase == PHASE_ENTRY) {
        hits[turn.ray] = Hit(ray.t_max, NO_HIT, 0.0, 0.0);
        stacks[stack_at(turn, 0u)] = LINK_DONE;
        link = ray.t_max >= ray.t_min ? 0u : LINK_DONE;
        depth = 0u;
    } else if (turn.phase == PHASE_EXIT) {
        hits[turn.ray] = finished(hits[turn.ray]);
    } else {
        BoxRay box = box_ray(ray, push.scene_low, push.scene_high);
        Hit hit = hits[turn.ray];
        if (turn.phase == PHASE_NODES) {
            Node node = load_node(Nodes(push.nodes), link);
            Met met = met_children(node, box, ray.t_min, hit.t);
            turn.met = any_child(met);
            turn.met_both = both_children(met);
            if (turn.met_both) {
                depth += 1u;
                stacks[stack_at(turn, depth)] = far_child(met, node);
            }
            link = turn.met ? near_child(met, node) : popped(turn, depth);
        } else {
            Shear shear = shear_of(ray.direction);
            uint first = leaf_first(link), triangles = leaf_count(link);
            for (uint i = first; i < first + triangles; ++i) {
                intersect(ray, box, shear, load_triangle(Triangles(push.triangles), i), hit);
            }
            hits[turn.ray] = hit;
            link = popped(turn, depth);
            if (ANY_HIT && hit.prim != NO_HIT) link = LINK_DONE;
        }
    }
    cursors[turn.thread] = uvec2(link, depth);
    return link;
}

// A loop runs until no lane is in it: those that left wait at its end.
uint next_phase(uint phase) {
    bool stays = phase == PHASE_LEAVES && any_leaf != 0u;
    if (any_node != 0u && !stays) return PHASE_NODES;
    return any_leaf != 0u ? PHASE_LEAVES : PHASE_EXIT;
}

void main() {
    uint sm = gl_WorkGroupID.x;
    for (uint i = lane(); i < VIRTUAL_LINES; i += WARP) places[i] = lines[sm * VIRTUAL_LINES + i];
    for (uint i = lane(); i < push.warps; i += WARP) resident[i] = slots[i * push.sms + sm];
    barrier();
    for (uint k = 0u; k < VIRTUAL_TURNS; ++k) {
        uint place = (push.turn + k) % push.warps;
        WarpSlot slot = resident[place];
        if (slot.warp * WARP < push.count) {
            uint thread = (place * push.sms + sm) * WARP + lane(), ray = slot.warp * WARP + lane();
            uvec2 cursor = cursors[thread];
            bool is_inside = slot.phase == PHASE_NODES    ? is_node(cursor.x)
                             : slot.phase == PHASE_LEAVES ? !is_node(cursor.x) && cursor.x != LINK_DONE
                                                          : true;
            Turn turn = Turn(slot.phase, is_inside && ray < push.count, ray, thread, cursor.x, cursor.y, false, false);
            if (lane() == 0u) any_node = 0u, any_leaf = 0u;
            uint link = ray < push.count ? cursor.x : LINK_DONE;
            if (turn.taken) link = step_lane(turn);
            for (uint i = 0u; i < instructions_of(slot.phase); ++i) {
                uint kind = kind_of(slot.phase, i), line = line_of(turn, i);
                AccessCounts counted = AccessCounts(0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u);
                access_lines(kind, line, push.sets, push.ways, push.hashed != 0u, counted);
                uint at = sm * ACCESS_KINDS + kind;
                if (line != NO_LINE) atomicAdd(counts[at].lanes, 1u);
                if (lane() == 0u) {
                    counts[at].instructions += counted.instructions;
                    counts[at].accesses += counted.accesses;
                    counts[at].misses += counted.misses;
                    counts[at].write_backs += counted.write_backs;
                }
            }
            if (is_node(link)) atomicOr(any_node, 1u);
            else if (link != LINK_DONE) atomicOr(any_leaf, 1u);
            barrier();
            bool ends = slot.phase == PHASE_EXIT;
            if (lane() == 0u) {
                resident[place] = WarpSlot(slot.warp + (ends ? push.sms * push.warps : 0u),
                                           ends ? PHASE_ENTRY : next_phase(slot.phase));
            }
            barrier();
        }
    }
    for (uint i = lane(); i < VIRTUAL_LINES; i += WARP) lines[sm * VIRTUAL_LINES + i] = places[i];
    for (uint i = lane(); i < push.warps; i += WARP) slots[i * push.sms + sm] = resident[i];
}
