// What the two stages of strategy `migrate` share: buffers, and the tables that a partition is.
//
// The record of a ray is rays[i], hits[i] and travels[i]: 32 + 16 + 16 bytes. Queues hold indices.
#ifndef MIGRATION_GLSL
#define MIGRATION_GLSL
#include "geometry.glsl"
#include "ray_buffer.glsl"

layout(set = 0, binding = 1, std430) buffer Hits { Hit hits[]; };
layout(set = 0, binding = 2, std430) buffer Counters { RayCounters counters[]; };
layout(set = 0, binding = 3, std430) buffer Travels { Travel travels[]; };
layout(set = 0, binding = 4, std430) buffer Queue { QueueEntry queue[]; };
layout(set = 0, binding = 5, std430) buffer Batches { Batch batches[2]; };
layout(set = 0, binding = 6, std430) buffer Rounds { Round rounds[]; };
layout(set = 0, binding = 7, std430) readonly buffer StepStarts { uvec2 step_starts[]; };

layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Subtrees { Subtree at[]; };
layout(buffer_reference, std430, buffer_reference_align = 4) readonly buffer Places { uint at[]; };
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Words { uint at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) writeonly buffer Visits { Visit at[]; };

layout(push_constant, std430) uniform MigratePush {
    uvec2 nodes;
    uvec2 triangles;
    vec3 scene_low;
    uint first;
    vec3 scene_high;
    uint count;
    uvec2 places;
    uvec2 subtrees;
    uvec2 shares;
    uvec2 visits;
    uvec2 taken_of_sm;
    uint first_top;
    uint root;
    uint round;
    uint parity;
    uint sms;
    uint lanes; // of a workgroup
} push;

// A top node's index in the whole tree.
uint place_of(uint link) { return Places(push.places).at[link - push.first_top]; }

uint subtree_of(uint link) { return link & ~SUBTREE_LINK; }

Subtree load_subtree(uint i) {
#ifdef TREE_TEXELS
    uvec4 texel = texelFetch(tree_texels, int((push.subtrees.x - push.nodes.x) / TEXEL_BYTES + i));
    return Subtree(texel.x, texel.y, texel.z, texel.w);
#else
    return Subtrees(push.subtrees).at[i];
#endif
}

const Travel TRAVEL_DONE = Travel(uvec2(0u), LINK_DONE, LINK_DONE);

#ifdef HIT_TEXELS
layout(set = 0, binding = HIT_TEXELS) uniform usamplerBuffer hit_texels;
layout(set = 0, binding = TRAVEL_TEXELS) uniform usamplerBuffer travel_texels;

Hit load_hit(uint i) {
    uvec4 texel = texelFetch(hit_texels, int(i));
    return Hit(uintBitsToFloat(texel.x), texel.y, uintBitsToFloat(texel.z), uintBitsToFloat(texel.w));
}

Travel load_travel(uint i) {
    uvec4 texel = texelFetch(travel_texels, int(i));
    return Travel(texel.xy, texel.z, texel.w);
}
#else
Hit load_hit(uint i) { return hits[i]; }
Travel load_travel(uint i) { return travels[i]; }
#endif

RayCounters sum(RayCounters a, RayCounters b) {
    return RayCounters(a.node_visits + b.node_visits, a.triangle_tests + b.triangle_tests, a.leaf_visits + b.leaf_visits,
                       a.stack_operations + b.stack_operations, a.top_visits + b.top_visits,
                       a.top_stack_operations + b.top_stack_operations, a.climbs + b.climbs, a.subtrees + b.subtrees,
                       a.migrations + b.migrations, a.bypasses + b.bypasses, a.suspensions + b.suspensions, 0u);
}

// Sums over the invocation's rays, added to the round's at its end.
uint taken = 0u, pushed = 0u, ended = 0u, faults = 0u;

void add_to_round() {
    if (taken > 0u) atomicAdd(rounds[push.round].taken, taken);
    if (pushed > 0u) atomicAdd(rounds[push.round].pushed, pushed);
    if (ended > 0u) atomicAdd(rounds[push.round].ended, ended);
    if (faults > 0u) atomicAdd(rounds[push.round].faults, faults);
}
#endif
