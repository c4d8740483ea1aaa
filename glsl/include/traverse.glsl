// The traversal core: while-while (Aila and Laine 2009), nearest child first, short of nothing but the
// buffers. The includer defines ANY_HIT as true or false and has `Geometry` push constants named `geometry`.
#ifndef TRAVERSE_GLSL
#define TRAVERSE_GLSL
#include "geometry.glsl"
#include "triangle.glsl"

// Loop iterations after which an invocation stops, 0 for no limit: drivers exist that silently end every
// loop after 65,535 iterations of an invocation.
layout(constant_id = SPEC_STEP_LIMIT) const uint STEP_LIMIT = 0u;
layout(constant_id = SPEC_COUNT) const bool COUNT = false;

// Where a traversal stands: the link to follow next and the links put off.
struct Cursor {
    uint link;
    uint depth;
};
uint stack[STACK_SIZE];

uint pop(inout Cursor cursor) {
    if (cursor.depth == 0u) return LINK_DONE;
    cursor.depth -= 1u;
    return stack[cursor.depth];
}

bool spent(uint steps) { return STEP_LIMIT != 0u && steps >= STEP_LIMIT; }

// Runs until the tree is done, a hit is found (ANY_HIT) or STEP_LIMIT is spent; `cursor.link` tells:
// LINK_DONE or where to go on.
void traverse(Nodes nodes, Triangles triangles, Ray ray, BoxRay box, Shear shear, inout Cursor cursor, inout Hit hit,
              inout RayCounters counters) {
    uint steps = 0u;
    while (cursor.link != LINK_DONE && !spent(steps)) {
        while ((cursor.link & LEAF_BIT) == 0u && !spent(steps)) {
            steps += 1u;
            if (COUNT) counters.node_visits += 1u;
            Node node = nodes.at[cursor.link];
            vec2 span0 = box_span(box, vec3(node.x.x, node.y.x, node.z.x), vec3(node.x.y, node.y.y, node.z.y), ray.t_min, hit.t);
            vec2 span1 = box_span(box, vec3(node.x.z, node.y.z, node.z.z), vec3(node.x.w, node.y.w, node.z.w), ray.t_min, hit.t);
            bool hit0 = span0.x <= span0.y, hit1 = span1.x <= span1.y;
            if (hit0 && hit1) {
                bool swapped = span1.x < span0.x;
                cursor.link = swapped ? node.child.y : node.child.x;
                stack[cursor.depth] = swapped ? node.child.x : node.child.y;
                cursor.depth += 1u;
            } else if (hit0 || hit1) {
                cursor.link = hit0 ? node.child.x : node.child.y;
            } else {
                cursor.link = pop(cursor);
            }
        }
        if (cursor.link == LINK_DONE || spent(steps)) break;
        uint first = cursor.link & LEAF_FIRST_MASK;
        uint count = (cursor.link >> LEAF_COUNT_SHIFT) & LEAF_COUNT_MASK;
        // A leaf is done whole, so a limit leaves room for one; +1 for the turn of the outer loop.
        steps += count + 1u;
        if (COUNT) counters.triangle_tests += count;
        for (uint i = first; i < first + count; ++i) intersect(ray, box, shear, triangles.at[i], hit);
        cursor.link = pop(cursor);
        if (ANY_HIT && hit.prim != NO_HIT) cursor.link = LINK_DONE;
    }
}
#endif
