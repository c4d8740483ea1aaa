// Scheduling: the walk of the top tree, nearest child first, from one subtree to the next. A ray has no
// stack here, only its trail, so that it can stop and go on anywhere.
#ifndef TOP_TREE_GLSL
#define TOP_TREE_GLSL
#include "migration.glsl"
#include "traverse.glsl"
#include "trail.glsl"

// Follows `link`, which is a child of the top node `above`, until it is a subtree's, and returns it.
// LINK_DONE stands for a link that is done, and is returned when nothing is pending any more.
uint next_subtree(Ray ray, BoxRay box, float t, uint link, uint above, uint came_from, inout uvec2 trail,
                  inout RayCounters counters, inout uint steps) {
    Nodes nodes = Nodes(push.nodes);
    bool walking = link == LINK_DONE ? trail != uvec2(0u) : is_node(link);
    uvec4 links = walking && link == LINK_DONE ? load_links(nodes, above) : uvec4(0u); // of `above`
    while (walking) {
        if (link == LINK_DONE) {
            uint level = deepest_pending(trail);
            while (links.w > level) {
                came_from = above;
                above = links.z;
                links = load_links(nodes, above);
                steps += 1u;
                if (COUNT) counters.climbs += 1u;
            }
            trail = trail_above(trail, level);
            link = other_child(links.xy, came_from);
            if (COUNT) {
                counters.stack_operations += 1u;
                counters.top_stack_operations += 1u;
            }
        }
        if (is_node(link)) {
            steps += 1u;
            above = link;
            Node node = load_node(nodes, link);
            links = uvec4(node.child, node.parent, node.level);
            Met met = met_children(node, box, ray.t_min, t);
            if (both_children(met)) trail |= level_bit(node.level);
            if (COUNT) {
                counters.node_visits += 1u;
                counters.top_visits += 1u;
                if (both_children(met)) {
                    counters.stack_operations += 1u;
                    counters.top_stack_operations += 1u;
                }
                if (RECORD) record_step(counters, place_of(link) | (both_children(met) ? STEP_PUSHED : 0u));
            }
            link = any_child(met) ? near_child(met, node) : LINK_DONE;
        }
        walking = link == LINK_DONE ? trail != uvec2(0u) : is_node(link);
    }
    return link;
}
#endif
