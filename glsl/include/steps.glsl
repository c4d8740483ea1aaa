// The step trace: every node and leaf that a ray visits, in order. A node's word is its index, with
// STEP_PUSHED if one of its children was put off; a leaf's is its link.
#ifndef STEPS_GLSL
#define STEPS_GLSL

layout(constant_id = SPEC_RECORD) const bool RECORD = false;

layout(buffer_reference, std430, buffer_reference_align = 4) writeonly buffer Steps { uint at[]; };

uvec2 steps_of_ray; // address of the words of the ray in hand; 0: it is not recorded
uint steps_before; // words of earlier rounds

// The ray's words go to `address`; those of the visits in `before` are there.
void begin_steps(uvec2 address, RayCounters before) {
    steps_before = before.node_visits + before.leaf_visits;
    steps_of_ray = address;
}

// Call it after the visit was counted: the counters tell the word's place.
void record_step(RayCounters counters, uint word) {
    if (RECORD && steps_of_ray != uvec2(0u)) {
        Steps(steps_of_ray).at[steps_before + counters.node_visits + counters.leaf_visits - 1u] = word;
    }
}
#endif
