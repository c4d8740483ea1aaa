#version 460
#extension GL_GOOGLE_include_directive : require
// Where in the sorted queue the entries of each SM begin; one more for where the last SM's end. A kernel of its
// own, because the migration kernel changes what is searched here.
#include "types.glsl"

layout(local_size_x = 32) in;

layout(set = 0, binding = 0, std430) readonly buffer Queue { QueueEntry queue[]; };
layout(set = 0, binding = 1, std430) readonly buffer Batches { Batch batches[2]; };
layout(set = 0, binding = 2, std430) readonly buffer FirstOfSm { uint first_of_sm[]; };
layout(set = 0, binding = 3, std430) writeonly buffer Shares { uint shares[]; };

layout(push_constant, std430) uniform QueuePush {
    uint parity;
    uint shift;
    uint round;
    uint sms;
    uint digits;
} push;

void main() {
    uint sm = gl_GlobalInvocationID.x;
    if (sm > push.sms) return;
    uint subtree = first_of_sm[sm];
    uint low = 0u, high = batches[push.parity].count;
    while (low < high) {
        uint middle = (low + high) / 2u;
        if (queue[middle].subtree < subtree) low = middle + 1u;
        else high = middle;
    }
    shares[sm] = low;
}
