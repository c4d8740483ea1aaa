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

// Traces ray push.first + local until it is done or `steps` reaches STEP_LIMIT. Its place is kept in
// travels[slot], where `resuming` finds it again.
void trace_ray(uint local, uint slot, bool resuming, inout uint steps) {
    uint i = push.first + local;
    Ray ray = load_ray(i);
    Cursor cursor = Cursor(0u, 0u);
    Hit hit = Hit(ray.t_max, NO_HIT, 0.0, 0.0);
    RayCounters counted = NOTHING_COUNTED;
    if (resuming) {
        cursor = cursor_of_trail(Nodes(push.nodes), 0u, 0u, travels[slot].link, travels[slot].trail);
        hit = hits[i];
        if (COUNT) counted = counters[i];
    }
    if (RECORD) begin_steps(step_starts[i], NOTHING_COUNTED);
    if (ray.t_max >= ray.t_min) {
        BoxRay box = box_ray(ray, push.scene_low, push.scene_high);
        traverse(Nodes(push.nodes), Triangles(push.triangles), ray, box, shear_of(ray.direction), cursor, hit, counted, steps);
    } else {
        cursor.link = LINK_DONE;
    }
    hits[i] = finished(hit);
    if (COUNT) counters[i] = counted;
    if (STEP_LIMIT != 0u) {
        uvec2 trail = uvec2(0u);
        if (cursor.link != LINK_DONE) {
            trail = trail_of_stack(Nodes(push.nodes), 0u, 0u, cursor, trail);
            atomicAdd(unfinished, 1u);
        }
        travels[slot] = Travel(trail, cursor.link, local);
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
    Ray ray;
    BoxRay box;
    Shear shear;
    Cursor cursor;
    Hit hit;
    RayCounters counted;
    while (local < push.count) {
        uint i = push.first + local;
        if (!holding) {
            ray = load_ray(i);
            box = box_ray(ray, push.scene_low, push.scene_high);
            shear = shear_of(ray.direction);
            cursor = Cursor(ray.t_max >= ray.t_min ? 0u : LINK_DONE, 0u);
            hit = Hit(ray.t_max, NO_HIT, 0.0, 0.0);
            counted = NOTHING_COUNTED;
            if (RECORD) begin_steps(step_starts[i], NOTHING_COUNTED);
        }
        while (cursor.link != LINK_DONE) {
            turn(Nodes(push.nodes), Triangles(push.triangles), ray, box, shear, cursor, hit, counted);
            if (!COHERENT) break;
        }
        holding = cursor.link != LINK_DONE;
        if (!holding) {
            hits[i] = finished(hit);
            if (COUNT) counters[i] = counted;
            local = take_ray();
        }
    }
}
#endif
#endif
