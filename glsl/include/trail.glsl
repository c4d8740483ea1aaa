// A traversal stack as 64 bits, so that the record of a ray never grows with depth. Bit L is set where the
// other child of the ancestor at level L is still to be visited; nodes know their parents (the level trail
// of Barringer and Akenine-Möller 2013, whose idea goes back to the restart trail of Laine 2010). Unlike a
// restart, going on from a trail visits no node twice.
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

// Adds to `trail` what is on the stack of a ray that stands at the node `link` in the tree below `root`.
uvec2 trail_of_stack(Nodes nodes, uint root, Cursor cursor, uvec2 trail) {
    uint depth = cursor.depth;
    for (uint link = cursor.link; depth > 0u && link != root;) {
        uint parent = load_links(nodes, link).z;
        uvec4 above = load_links(nodes, parent);
        if (stack[depth - 1u] == other_child(above.xy, link)) {
            trail |= level_bit(above.w);
            depth -= 1u;
        }
        link = parent;
    }
    return trail;
}

// The way back: fills the stack with what is pending from `root_level` down.
Cursor cursor_of_trail(Nodes nodes, uint root_level, uint link, uvec2 trail) {
    uvec2 bits = trail ^ trail_above(trail, root_level);
    uint depth = uint(bitCount(bits.x) + bitCount(bits.y));
    Cursor cursor = Cursor(link, depth);
    while (depth > 0u) {
        uint parent = load_links(nodes, link).z;
        uvec4 above = load_links(nodes, parent);
        if (is_pending(trail, above.w)) {
            depth -= 1u;
            stack[depth] = other_child(above.xy, link);
        }
        link = parent;
    }
    return cursor;
}
#endif
