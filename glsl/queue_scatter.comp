#version 460
#extension GL_GOOGLE_include_directive : require
// Moves each entry to its place among those of its digit.
#include "queue.glsl"

layout(set = 0, binding = 3, std430) writeonly buffer Sorted { QueueEntry sorted[]; };

void main() {
    Batch batch = batches[push.parity];
    count_strip(batch);
    barrier();
    for (uint digit = lane(); digit < push.digits; digit += WARP) {
        uint place = counts[digit * batch.tiles + gl_WorkGroupID.x];
        for (uint k = 0u; k < WARP; ++k) {
            uint count = columns[digit * WARP + k];
            columns[digit * WARP + k] = place;
            place += count;
        }
    }
    barrier();
    for (uint at = strip_begin(batch); at < strip_end(batch); ++at) {
        QueueEntry entry = entries[at];
        if (entry.subtree != LINK_DONE) {
            uint place = columns[column(digit_of(entry.subtree))];
            columns[column(digit_of(entry.subtree))] = place + 1u;
            sorted[place] = entry;
        }
    }
}
