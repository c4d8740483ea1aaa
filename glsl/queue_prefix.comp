#version 460
#extension GL_GOOGLE_include_directive : require
// Turns the counts of all digits and tiles into places: an exclusive prefix sum by one workgroup, each
// invocation summing a part. Its total is the number of active entries.
#include "types.glsl"
#include "batch.glsl"

layout(local_size_x = 256) in;

layout(set = 0, binding = 0, std430) buffer Counts { uint counts[]; };
layout(set = 0, binding = 1, std430) buffer Batches { Batch batches[2]; };
layout(set = 0, binding = 2, std430) buffer Rounds { Round rounds[]; };

layout(push_constant, std430) uniform QueuePush {
    uint parity;
    uint shift;
    uint round;
    uint sms;
    uint digits;
} push;

shared uint sums[PREFIX_LANES];

void main() {
    uint lane = gl_LocalInvocationID.x;
    uint words = push.digits * batches[push.parity].tiles;
    uint part = (words + PREFIX_LANES - 1u) / PREFIX_LANES;
    uint begin = min(lane * part, words), end = min(begin + part, words);
    uint sum = 0u;
    for (uint k = begin; k < end; ++k) sum += counts[k];
    sums[lane] = sum;
    barrier();
    // Hillis and Steele 1986.
    for (uint distance = 1u; distance < PREFIX_LANES; distance *= 2u) {
        uint before = lane >= distance ? sums[lane - distance] : 0u;
        barrier();
        sums[lane] += before;
        barrier();
    }
    uint place = sums[lane] - sum;
    for (uint k = begin; k < end; ++k) {
        uint count = counts[k];
        counts[k] = place;
        place += count;
    }
    if (lane == PREFIX_LANES - 1u) {
        batches[1u - push.parity] = batch_of(sums[lane], push.sms);
        rounds[push.round].queued = sums[lane];
    }
}
