// What strategies `direct` and `persistent` do with a ray: its way through the whole tree.
#ifndef TRACE_GLSL
#define TRACE_GLSL
#include "ray_buffer.glsl"
#include "traverse.glsl"
#include "trail.glsl"

layout(set = 0, binding = 1, std430) buffer Hits { Hit hits[]; };
layout(set = 0, binding = 2, std430) buffer Counters { RayCounters counters[]; };
// Where rays wait that ran into STEP_LIMIT.
layout(set = 0, binding = 3, std430) buffer Travels { Travel travels[]; };
layout(set = 0, binding = 4, std430) buffer Unfinished { uint unfinished; };
layout(set = 0, binding = 5, std430) buffer NextRay { uint next_ray[]; };
layout(set = 0, binding = 6, std430) readonly buffer StepStarts { uvec2 step_starts[]; };

layout(push_constant, std430) uniform TracePush {
    uvec2 nodes;
    uvec2 triangles;
    vec3 scene_low;
    uint first;
    vec3 scene_high;
    uint count;
    uint resume;
    uint strip; // rays a workgroup, with CPU_LANES
} push;

// A ray on its way.
struct Traced {
    Ray ray;
    BoxRay box;
    Shear shear;
    Cursor cursor;
    Hit hit;
    RayCounters counted;
};

// Ray i at the root, or done already if it is dead.
Traced begin(uint i) {
    Ray ray = load_ray(i);
    bool live = ray.t_max >= ray.t_min;
    if (RECORD) begin_steps(step_starts[i], NOTHING_COUNTED);
    return Traced(ray, box_ray(ray, push.scene_low, push.scene_high), shear_of(ray.direction),
                  Cursor(live ? 0u : LINK_DONE, 0u), Hit(ray.t_max, NO_HIT, 0.0, 0.0), NOTHING_COUNTED);
}

void end(uint i, Traced traced) {
    hits[i] = finished(traced.hit);
    if (COUNT) counters[i] = traced.counted;
}

// Traces ray push.first + local until it is done or `steps` reaches STEP_LIMIT. Its place is kept in
// travels[slot], where `resuming` finds it again.
void trace_ray(uint local, uint slot, bool resuming, inout uint steps) {
    uint i = push.first + local;
    Traced traced = begin(i);
    if (resuming) {
        traced.cursor = cursor_of_trail(Nodes(push.nodes), 0u, 0u, travels[slot].link, travels[slot].trail);
        traced.hit = hits[i];
        if (COUNT) traced.counted = counters[i];
    }
    traverse(Nodes(push.nodes), Triangles(push.triangles), traced.ray, traced.box, traced.shear, traced.cursor, traced.hit,
             traced.counted, steps);
    end(i, traced);
    if (STEP_LIMIT != 0u) {
        uvec2 trail = uvec2(0u);
        if (traced.cursor.link != LINK_DONE) {
            trail = trail_of_stack(Nodes(push.nodes), 0u, 0u, traced.cursor, trail);
            atomicAdd(unfinished, 1u);
        }
        travels[slot] = Travel(trail, traced.cursor.link, local);
    }
}

#ifdef CPU_LANES
// Rays go the same way, so that lanes had better start together; otherwise a lane takes its next ray at once
// (Aila and Laine 2009, section 3.3, of warps; 1.2x for diffuse rays on lavapipe 25, and 0.7x for camera rays).
layout(constant_id = SPEC_COHERENT) const bool COHERENT = true;

// The next ray for this invocation; `push.count` or more if there is none.
uint take_ray();

// Traces rays push.first + take_ray() as long as there are any, without STEP_LIMIT.
void trace_rays() {
    uint local = take_ray();
    bool holding = false;
    Traced traced;
    while (local < push.count) {
        if (!holding) traced = begin(push.first + local);
        while (traced.cursor.link != LINK_DONE) {
            turn(Nodes(push.nodes), Triangles(push.triangles), traced.ray, traced.box, traced.shear, traced.cursor, traced.hit,
                 traced.counted);
            if (!COHERENT) break;
        }
        holding = traced.cursor.link != LINK_DONE;
        if (!holding) {
            end(push.first + local, traced);
            local = take_ray();
        }
    }
}
#endif
#endif
