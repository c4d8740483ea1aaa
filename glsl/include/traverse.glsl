// The traversal core, nearest child first, short of nothing but the buffers. All strategies use it.
//
// GPUs go while-while (Aila and Laine 2009): a warp's lanes go down until each has a leaf, then test it whole.
// With CPU_LANES (the `*_cpu.comp` kernels, for the 4 to 16 lanes of software drivers) a turn visits one node or
// tests one triangle, so that no lane waits for the longest way down.
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

// Added to a leaf's link: its first triangle is done, one is left less.
const uint NEXT_TRIANGLE = 1u - (1u << LEAF_COUNT_SHIFT);

// Where a traversal stands: the link to follow next and the links put off.
struct Cursor {
    uint link;
    uint depth;
};
#ifdef CPU_LANES
uint stack[STACK_SIZE + 1u]; // one more, for what `turn` stores above a full stack
bool within_leaf = false; // of which some triangles are tested
#else
uint stack[STACK_SIZE];
#endif

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

uint leaf_first(uint link) { return link & LEAF_FIRST_MASK; }
uint leaf_count(uint link) { return (link >> LEAF_COUNT_SHIFT) & LEAF_COUNT_MASK; }

void count_visit(Met met, uint link, inout RayCounters counters) {
    counters.node_visits += 1u;
    if (both_children(met)) counters.stack_operations += 1u;
    record_step(counters, link | (both_children(met) ? STEP_PUSHED : 0u));
}

#ifdef CPU_LANES
// One turn: visits a node or tests a triangle.
void turn(Nodes nodes, Triangles triangles, Ray ray, BoxRay box, Shear shear, inout Cursor cursor, inout Hit hit,
          inout RayCounters counters) {
    uint link = cursor.link, count = leaf_count(link);
    bool inner = is_node(link), goes_on = !inner && count > 1u;
    // Lanes at nodes and lanes at triangles fetch together.
    uint first = inner ? node_texel(link) : triangle_texel(nodes, triangles, leaf_first(link));
    Texels texels = fetch_texels(tree_texels, first);
    uint put_off = 0u;
    bool pushes = false;
    if (inner) {
        Node node = node_of(texels, link);
        Met met = met_children(node, box, ray.t_min, hit.t);
        if (COUNT) count_visit(met, link, counters);
        goes_on = any_child(met);
        pushes = both_children(met);
        put_off = far_child(met, node);
        cursor.link = near_child(met, node);
    } else {
        if (COUNT) {
            if (!within_leaf) {
                counters.leaf_visits += 1u;
                record_step(counters, link);
            }
            counters.triangle_tests += min(count, 1u);
            within_leaf = goes_on;
        }
        if (count > 0u) intersect(ray, box, shear, triangle_of(texels), hit);
        cursor.link = link + NEXT_TRIANGLE;
    }
    // Stored whether it is kept or not, because a store by some lanes is a branch a lane.
    stack[cursor.depth] = put_off;
    if (pushes) cursor.depth += 1u;
    if (!goes_on) cursor.link = ANY_HIT && hit.prim != NO_HIT ? LINK_DONE : pop(cursor, counters);
}
#endif

// Runs until the tree is done, a hit is found (ANY_HIT) or STEP_LIMIT is spent; `cursor.link` tells:
// LINK_DONE, or the node where to go on. It never stops at a leaf, which does not know its parent.
void traverse(Nodes nodes, Triangles triangles, Ray ray, BoxRay box, Shear shear, inout Cursor cursor, inout Hit hit,
              inout RayCounters counters, inout uint steps) {
    while (cursor.link != LINK_DONE && !(spent(steps) && is_node(cursor.link))) {
#ifdef CPU_LANES
        steps += 1u;
        turn(nodes, triangles, ray, box, shear, cursor, hit, counters);
#else
        while (is_node(cursor.link) && !spent(steps)) {
            steps += 1u;
            Node node = load_node(nodes, cursor.link);
            Met met = met_children(node, box, ray.t_min, hit.t);
            if (COUNT) count_visit(met, cursor.link, counters);
            if (both_children(met)) {
                cursor.link = met.swapped ? node.child.y : node.child.x;
                stack[cursor.depth] = far_child(met, node);
                cursor.depth += 1u;
            } else if (any_child(met)) {
                cursor.link = met.child0 ? node.child.x : node.child.y;
            } else {
                cursor.link = pop(cursor, counters);
            }
        }
        if (!is_node(cursor.link) && cursor.link != LINK_DONE) {
            uint first = leaf_first(cursor.link), count = leaf_count(cursor.link);
            if (COUNT) {
                counters.leaf_visits += 1u;
                counters.triangle_tests += count;
                record_step(counters, cursor.link);
            }
            for (uint i = first; i < first + count; ++i) {
                intersect(ray, box, shear, load_triangle(triangles, i), hit);
            }
            steps += max(count, 1u);
            cursor.link = ANY_HIT && hit.prim != NO_HIT ? LINK_DONE : pop(cursor, counters);
        }
#endif
    }
}
#endif
