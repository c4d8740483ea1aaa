#version 460
#extension GL_GOOGLE_include_directive : require
// How many entries of each digit a tile has.
#include "queue.glsl"

void main() {
    Batch batch = batches[push.parity];
    count_strip(batch);
    barrier();
    for (uint digit = lane(); digit < push.digits; digit += WARP) {
        uint sum = 0u;
        for (uint k = 0u; k < WARP; ++k) sum += columns[digit * WARP + k];
        counts[digit * batch.tiles + gl_WorkGroupID.x] = sum;
    }
}
