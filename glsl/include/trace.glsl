// Body of the trace kernels: one invocation a ray, the whole tree (strategy `direct`).
#ifndef TRACE_GLSL
#define TRACE_GLSL
#include "traverse.glsl"

layout(local_size_x = 32) in;

layout(set = 0, binding = 0, std430) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 1, std430) buffer Hits { Hit hits[]; };
layout(set = 0, binding = 2, std430) buffer Counters { RayCounters counters[]; };
// Cursors and stacks of rays that ran into STEP_LIMIT: word w of ray i is at [w * count + i].
layout(set = 0, binding = 3, std430) buffer Suspended { uint suspended[]; };
layout(set = 0, binding = 4, std430) buffer Unfinished { uint unfinished; };

layout(push_constant, std430) uniform TracePush {
    uvec2 nodes;
    uvec2 triangles;
    vec3 scene_low;
    uint first;
    vec3 scene_high;
    uint count;
    uint resume;
} push;

Cursor load_cursor(uint local) {
    Cursor cursor = Cursor(suspended[local], suspended[push.count + local]);
    for (uint k = 0u; k < cursor.depth; ++k) stack[k] = suspended[(k + 2u) * push.count + local];
    return cursor;
}

void store_cursor(uint local, Cursor cursor) {
    suspended[local] = cursor.link;
    if (cursor.link == LINK_DONE) return;
    suspended[push.count + local] = cursor.depth;
    for (uint k = 0u; k < cursor.depth; ++k) suspended[(k + 2u) * push.count + local] = stack[k];
    atomicAdd(unfinished, 1u);
}

void main() {
    uint local = gl_GlobalInvocationID.x;
    if (local >= push.count) return;
    uint i = push.first + local;
    Ray ray = rays[i];
    bool resuming = STEP_LIMIT != 0u && push.resume != 0u;
    Cursor cursor = Cursor(0u, 0u);
    Hit hit = Hit(ray.t_max, NO_HIT, 0.0, 0.0);
    RayCounters counted = RayCounters(0u, 0u);
    if (resuming) {
        cursor = load_cursor(local);
        if (cursor.link == LINK_DONE) return;
        hit = hits[i];
        if (COUNT) counted = counters[i];
    }
    if (ray.t_max >= ray.t_min) {
        BoxRay box = box_ray(ray, push.scene_low, push.scene_high);
        traverse(Nodes(push.nodes), Triangles(push.triangles), ray, box, shear_of(ray.direction), cursor, hit, counted);
    } else {
        cursor.link = LINK_DONE;
    }
    // Which triangle an any-hit ray meets depends on the order of visits; that it meets one does not.
    if (ANY_HIT && hit.prim != NO_HIT) hit = Hit(0.0, 0u, 0.0, 0.0);
    hits[i] = hit;
    if (COUNT) counters[i] = counted;
    if (STEP_LIMIT != 0u) store_cursor(local, cursor);
}
#endif
