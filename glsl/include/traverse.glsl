// The traversal core, nearest child first, short of nothing but the buffers. All strategies use it.
//
// GPUs go while-while (Aila and Laine 2009): a warp's lanes go down until each has a leaf, then test it whole.
// With CPU_LANES (the `*_cpu.comp` kernels, for the 4 to 16 lanes of software drivers) it is if-if: each turn
// visits one node or tests one triangle, so that no lane waits for the longest way down; 1.07x on lavapipe 25.
// Each ray visits the same nodes and triangles in the same order either way.
#ifndef TRAVERSE_GLSL
#define TRAVERSE_GLSL
#include "geometry.glsl"
#include "triangle.glsl"

layout(constant_id = SPEC_ANY_HIT) const bool ANY_HIT = false;
// Steps after which an invocation stops, 0 for no limit. A step is a node visit, a triangle test or an empty
// leaf, so it is the same on all devices; no invocation takes more than three turns of any loop a step.
layout(constant_id = SPEC_STEP_LIMIT) const uint STEP_LIMIT = 0u;
layout(constant_id = SPEC_COUNT) const bool COUNT = false;
#include "steps.glsl"

#ifdef CPU_LANES
#define TURN if
#else
#define TURN while
#endif

// Added to a leaf's link: its first triangle is done, one is left less.
const uint NEXT_TRIANGLE = 1u - (1u << LEAF_COUNT_SHIFT);

// Where a traversal stands: the link to follow next and the links put off.
struct Cursor {
    uint link;
    uint depth;
};
uint stack[STACK_SIZE];

uint pop(inout Cursor cursor, inout RayCounters counters) {
    if (cursor.depth == 0u) return LINK_DONE;
    cursor.depth -= 1u;
    if (COUNT) counters.stack_operations += 1u;
    return stack[cursor.depth];
}

bool is_node(uint link) { return (link & LEAF_BIT) == 0u; }

bool spent(uint steps) { return STEP_LIMIT != 0u && steps >= STEP_LIMIT; }

// Which children of a node a ray meets, the nearest first.
struct Met {
    bool any;
    bool both;
    uint near;
    uint far;
};

Met met_children(Node node, BoxRay box, float t_min, float t_max) {
    vec2 span0 = box_span(box, vec3(node.x.x, node.y.x, node.z.x), vec3(node.x.y, node.y.y, node.z.y), t_min, t_max);
    vec2 span1 = box_span(box, vec3(node.x.z, node.y.z, node.z.z), vec3(node.x.w, node.y.w, node.z.w), t_min, t_max);
    bool hit0 = span0.x <= span0.y, hit1 = span1.x <= span1.y;
    bool second = hit1 && (!hit0 || span1.x < span0.x);
    return Met(hit0 || hit1, hit0 && hit1, second ? node.child.y : node.child.x, second ? node.child.x : node.child.y);
}

// Runs until the tree is done, a hit is found (ANY_HIT) or STEP_LIMIT is spent; `cursor.link` tells:
// LINK_DONE, or the node where to go on. It never stops at a leaf, which does not know its parent.
void traverse(Nodes nodes, Triangles triangles, Ray ray, BoxRay box, Shear shear, inout Cursor cursor, inout Hit hit,
              inout RayCounters counters, inout uint steps) {
    uint entered = cursor.link;
    while (cursor.link != LINK_DONE && !(spent(steps) && is_node(cursor.link))) {
        TURN (is_node(cursor.link) && !spent(steps)) {
            steps += 1u;
            Met met = met_children(load_node(nodes, cursor.link), box, ray.t_min, hit.t);
            if (COUNT) {
                counters.node_visits += 1u;
                if (met.both) counters.stack_operations += 1u;
                record_step(counters, cursor.link | (met.both ? STEP_PUSHED : 0u));
            }
            if (met.any) {
                cursor.link = met.near;
                if (met.both) {
                    stack[cursor.depth] = met.far;
                    cursor.depth += 1u;
                }
            } else {
                cursor.link = pop(cursor, counters);
            }
            entered = cursor.link;
        }
        if (!is_node(cursor.link) && cursor.link != LINK_DONE) {
            uint first = cursor.link & LEAF_FIRST_MASK;
            uint count = (cursor.link >> LEAF_COUNT_SHIFT) & LEAF_COUNT_MASK;
            if (COUNT && cursor.link == entered) {
                counters.leaf_visits += 1u;
                record_step(counters, entered);
            }
#ifdef CPU_LANES
            if (count > 0u) {
                intersect(ray, box, shear, load_triangle(triangles, first), hit);
                cursor.link += NEXT_TRIANGLE;
            }
            bool done = count <= 1u;
            count = min(count, 1u);
#else
            for (uint i = first; i < first + count; ++i) {
                intersect(ray, box, shear, load_triangle(triangles, i), hit);
            }
            bool done = true;
#endif
            steps += max(count, 1u);
            if (COUNT) counters.triangle_tests += count;
            if (done) {
                cursor.link = ANY_HIT && hit.prim != NO_HIT ? LINK_DONE : pop(cursor, counters);
                entered = cursor.link;
            }
        }
    }
}
#endif
