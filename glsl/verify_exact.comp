#version 460
#extension GL_GOOGLE_include_directive : require
// The functions of exact.glsl over ranges of operands, for `caribou verify` to compare with the host's.
#include "exact.glsl"

layout(local_size_x = 256) in;

layout(set = 0, binding = 0, std430) readonly buffer Factors { vec2 factors[]; };
layout(set = 0, binding = 1, std430) writeonly buffer Answers { float answers[]; };

layout(push_constant, std430) uniform VerifyPush {
    uint operation; // VERIFY_*
    uint first; // bits of the first operand; the others follow
} push;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= answers.length()) return;
    float x = uintBitsToFloat(push.first + i);
    if (push.operation == VERIFY_RCP) answers[i] = exact_rcp(x);
    if (push.operation == VERIFY_SQRT) answers[i] = exact_sqrt(x);
    if (push.operation == VERIFY_PRODUCT_ERROR) {
        vec2 f = factors[i];
        answers[i] = product_error(f.x, f.y, f.x * f.y);
    }
}
