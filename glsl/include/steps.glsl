// The step trace: every node and leaf that a ray visits, in order. A node's word is its index, with
// STEP_PUSHED if one of its children was put off; a leaf's is its link.
#ifndef STEPS_GLSL
#define STEPS_GLSL

layout(constant_id = SPEC_RECORD) const bool RECORD = false;

layout(buffer_reference, std430, buffer_reference_align = 4) writeonly buffer Steps { uint at[]; };

Steps steps_of_ray; // where the words of the ray in hand begin
uint steps_before; // words of earlier rounds
bool is_recorded;

// The ray's words go to `address`, those of the visits in `before` are there; 0: it is not recorded.
void begin_steps(uvec2 address, RayCounters before) {
    is_recorded = address != uvec2(0u);
    steps_before = before.node_visits + before.leaf_visits;
    steps_of_ray = Steps(address);
}

// Call it after the visit was counted: the counters tell the word's place.
void record_step(RayCounters counters, uint word) {
    if (RECORD && is_recorded) steps_of_ray.at[steps_before + counters.node_visits + counters.leaf_visits - 1u] = word;
}
#endif
