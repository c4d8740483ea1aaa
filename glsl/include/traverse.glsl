// The traversal core, nearest child first, short of nothing but the buffers. The includer defines ANY_HIT as
// true or false.
//
// GPUs go while-while (Aila and Laine 2009): a warp's lanes go down until each has a leaf, then test it whole.
// With CPU_LANES (the `*_cpu.comp` kernels, for the 4 to 16 lanes of software drivers) it is if-if: each turn
// visits one node or tests one triangle, so that no lane waits for the longest way down; 1.07x on lavapipe 25.
// Each ray visits the same nodes and triangles in the same order either way.
#ifndef TRAVERSE_GLSL
#define TRAVERSE_GLSL
#include "geometry.glsl"
#include "triangle.glsl"

// Loop iterations after which an invocation stops, 0 for no limit: drivers exist that silently end every
// loop after 65,535 iterations of an invocation.
layout(constant_id = SPEC_STEP_LIMIT) const uint STEP_LIMIT = 0u;
layout(constant_id = SPEC_COUNT) const bool COUNT = false;

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
        TURN ((cursor.link & LEAF_BIT) == 0u && !spent(steps)) {
            steps += 1u;
            if (COUNT) counters.node_visits += 1u;
            Node node = load_node(nodes, cursor.link);
            vec2 span0 = box_span(box, vec3(node.x.x, node.y.x, node.z.x), vec3(node.x.y, node.y.y, node.z.y), ray.t_min, hit.t);
            vec2 span1 = box_span(box, vec3(node.x.z, node.y.z, node.z.z), vec3(node.x.w, node.y.w, node.z.w), ray.t_min, hit.t);
            bool hit0 = span0.x <= span0.y, hit1 = span1.x <= span1.y;
#ifdef CPU_LANES
            if (hit0 || hit1) {
                bool second = hit1 && (!hit0 || span1.x < span0.x);
                cursor.link = second ? node.child.y : node.child.x;
                if (hit0 && hit1) {
                    stack[cursor.depth] = second ? node.child.x : node.child.y;
                    cursor.depth += 1u;
                }
#else // 1.05x on an H100 against the above, which is 1.05x on lavapipe 25 against this
            if (hit0 && hit1) {
                bool second = span1.x < span0.x;
                cursor.link = second ? node.child.y : node.child.x;
                stack[cursor.depth] = second ? node.child.x : node.child.y;
                cursor.depth += 1u;
            } else if (hit0 || hit1) {
                cursor.link = hit0 ? node.child.x : node.child.y;
#endif
            } else {
                cursor.link = pop(cursor);
            }
        }
        if ((cursor.link & LEAF_BIT) != 0u && cursor.link != LINK_DONE && !spent(steps)) {
            uint first = cursor.link & LEAF_FIRST_MASK;
            uint count = (cursor.link >> LEAF_COUNT_SHIFT) & LEAF_COUNT_MASK;
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
            steps += count;
            if (COUNT) counters.triangle_tests += count;
            if (done) cursor.link = ANY_HIT && hit.prim != NO_HIT ? LINK_DONE : pop(cursor);
        }
        steps += 1u;
    }
}
#endif
