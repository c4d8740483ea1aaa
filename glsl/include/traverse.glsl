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

// Node and first triangle of a link. Where one lane of a software driver loads, all do, from whatever their index happens
// to be: with CPU_LANES a link of the other kind gives index 0, which is in the cache; 1.06x to 1.1x for diffuse rays on
// lavapipe 25. By LEAF_BIT, the sign, and not by a condition, which a compiler takes for known within the branch.
#ifdef CPU_LANES
uint node_of(uint link) { return link & ~uint(int(link) >> 31); }
uint first_of(uint link) { return link & LEAF_FIRST_MASK & uint(int(link) >> 31); }
#else
uint node_of(uint link) { return link; }
uint first_of(uint link) { return link & LEAF_FIRST_MASK; }
#endif

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

// Which triangle an any-hit ray meets depends on the order of visits; that it meets one does not.
Hit finished(Hit hit) { return ANY_HIT && hit.prim != NO_HIT ? Hit(0.0, 0u, 0.0, 0.0) : hit; }

bool is_node(uint link) { return (link & LEAF_BIT) == 0u; }

bool spent(uint steps) { return STEP_LIMIT != 0u && steps >= STEP_LIMIT; }

// Which children of a node a ray meets, and whether it enters child 1 first.
struct Met {
    bool child0;
    bool child1;
    bool swapped;
};

bool any_child(Met met) { return met.child0 || met.child1; }
bool both_children(Met met) { return met.child0 && met.child1; }
// The nearest child, if there is any, and the other.
uint near_child(Met met, Node node) { return met.child1 && (!met.child0 || met.swapped) ? node.child.y : node.child.x; }
uint far_child(Met met, Node node) { return met.swapped ? node.child.x : node.child.y; }

Met met_children(Node node, BoxRay box, float t_min, float t_max) {
    vec2 span0 = box_span(box, vec3(node.x.x, node.y.x, node.z.x), vec3(node.x.y, node.y.y, node.z.y), t_min, t_max);
    vec2 span1 = box_span(box, vec3(node.x.z, node.y.z, node.z.z), vec3(node.x.w, node.y.w, node.z.w), t_min, t_max);
    return Met(span0.x <= span0.y, span1.x <= span1.y, span1.x < span0.x);
}

// Runs until the tree is done, a hit is found (ANY_HIT) or STEP_LIMIT is spent; `cursor.link` tells:
// LINK_DONE, or the node where to go on. It never stops at a leaf, which does not know its parent.
void traverse(Nodes nodes, Triangles triangles, Ray ray, BoxRay box, Shear shear, inout Cursor cursor, inout Hit hit,
              inout RayCounters counters, inout uint steps) {
    uint entered = cursor.link;
    while (cursor.link != LINK_DONE && !(spent(steps) && is_node(cursor.link))) {
        TURN (is_node(cursor.link) && !spent(steps)) {
            steps += 1u;
            Node node = load_node(nodes, node_of(cursor.link));
            Met met = met_children(node, box, ray.t_min, hit.t);
            if (COUNT) {
                counters.node_visits += 1u;
                if (both_children(met)) counters.stack_operations += 1u;
                record_step(counters, cursor.link | (both_children(met) ? STEP_PUSHED : 0u));
            }
#ifdef CPU_LANES
            if (any_child(met)) {
                cursor.link = near_child(met, node);
                if (both_children(met)) {
                    stack[cursor.depth] = far_child(met, node);
                    cursor.depth += 1u;
                }
#else // 1.04x on an H100 against the above, which is 1.05x on lavapipe 25 against this
            if (both_children(met)) {
                cursor.link = met.swapped ? node.child.y : node.child.x;
                stack[cursor.depth] = far_child(met, node);
                cursor.depth += 1u;
            } else if (any_child(met)) {
                cursor.link = met.child0 ? node.child.x : node.child.y;
#endif
            } else {
                cursor.link = pop(cursor, counters);
            }
            entered = cursor.link;
        }
        if (!is_node(cursor.link) && cursor.link != LINK_DONE) {
            uint first = first_of(cursor.link);
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
