// A traversal stack as 64 bits, so that the record of a ray never grows with depth. Bit L is set where the
// other child of the ancestor at level L is still to be visited (the level trail of Barringer and Akenine-Möller
// 2013, whose idea goes back to the restart trail of Laine 2010). Unlike a restart, going on from a trail visits
// no node twice: the way down to a node follows from its index, since nodes are in depth-first order.
#ifndef TRAIL_GLSL
#define TRAIL_GLSL
#include "geometry.glsl"

uvec2 level_bit(uint level) { return level < 32u ? uvec2(1u << level, 0u) : uvec2(0u, 1u << (level - 32u)); }

bool is_pending(uvec2 trail, uint level) { return (trail & level_bit(level)) != uvec2(0u); }

// Deepest level at which a child is pending; the trail must not be empty.
uint deepest_pending(uvec2 trail) { return trail.y != 0u ? 32u + findMSB(trail.y) : findMSB(trail.x); }

// The levels above `level`, which is 64 for leaves below the deepest nodes.
uvec2 trail_above(uvec2 trail, uint level) {
    if (level >= STACK_SIZE) return trail;
    uvec2 bit = level_bit(level);
    return level < 32u ? uvec2(trail.x & (bit.x - 1u), 0u) : uvec2(trail.x, trail.y & (bit.y - 1u));
}

uint other_child(uvec2 child, uint link) { return child.x == link ? child.y : child.x; }

// The child of a node below which, or at which, the node `link` is: what is below the second child comes last.
uint child_towards(uvec2 child, uint link) { return is_node(child.y) && link >= child.y ? child.y : child.x; }

// Adds to `trail` what is on the stack of a ray that stands at the node `link` in the tree below `root`.
uvec2 trail_of_stack(Nodes nodes, uint root, uint root_level, Cursor cursor, uvec2 trail) {
    uint at = root;
    uint level = root_level;
    for (uint noted = 0u; noted < cursor.depth && at != cursor.link; ++level) {
        uvec2 child = load_children(nodes, at);
        at = child_towards(child, cursor.link);
        if (stack[noted] == other_child(child, at)) {
            trail |= level_bit(level);
            noted += 1u;
        }
    }
    return trail;
}

// The way back: fills the stack with what is pending from `root_level` down.
Cursor cursor_of_trail(Nodes nodes, uint root, uint root_level, uint link, uvec2 trail) {
    uvec2 bits = trail ^ trail_above(trail, root_level);
    uint depth = uint(bitCount(bits.x) + bitCount(bits.y));
    Cursor cursor = Cursor(link, 0u);
    uint at = root;
    for (uint level = root_level; cursor.depth < depth; ++level) {
        uvec2 child = load_children(nodes, at);
        at = child_towards(child, link);
        if (is_pending(trail, level)) {
            stack[cursor.depth] = other_child(child, at);
            cursor.depth += 1u;
        }
    }
    return cursor;
}
#endif
