// Queues are built by a stable counting sort of the entries by subtree, a digit of its index a pass, lowest
// first; entries of rays that ended are left out. Stable means canonical: the order is the same on all drivers.
//
// A workgroup goes through a tile of 32 strips, each invocation through one strip from first to last, counting
// digits in a column of its own (Satish, Harris and Garland 2009, section 4): no atomics, no subgroups.
#ifndef QUEUE_GLSL
#define QUEUE_GLSL
#include "types.glsl"

layout(local_size_x = 32) in;

layout(set = 0, binding = 0, std430) readonly buffer Entries { QueueEntry entries[]; };
// Of each digit and tile: entries, then the place of the first. [digit * tiles + tile]
layout(set = 0, binding = 1, std430) buffer Counts { uint counts[]; };
layout(set = 0, binding = 2, std430) readonly buffer Batches { Batch batches[2]; };

layout(push_constant, std430) uniform QueuePush {
    uint parity;
    uint shift;
    uint round;
    uint sms;
    uint digits; // values of a digit, a power of two
} push;

shared uint columns[MOST_DIGITS * WARP];

uint lane() { return gl_LocalInvocationID.x; }
uint column(uint digit) { return digit * WARP + lane(); }
uint digit_of(uint subtree) { return (subtree >> push.shift) & (push.digits - 1u); }

uint strip_begin(Batch batch) { return min((gl_WorkGroupID.x * WARP + lane()) * batch.strip, batch.count); }
uint strip_end(Batch batch) { return min(strip_begin(batch) + batch.strip, batch.count); }

void count_strip(Batch batch) {
    for (uint digit = 0u; digit < push.digits; ++digit) columns[column(digit)] = 0u;
    for (uint at = strip_begin(batch); at < strip_end(batch); ++at) {
        uint subtree = entries[at].subtree;
        if (subtree != LINK_DONE) columns[column(digit_of(subtree))] += 1u;
    }
}
#endif
