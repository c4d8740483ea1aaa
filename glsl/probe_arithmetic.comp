#version 460
// The driver's quotient, reciprocal, square root, fma, product and sum of operands that no compiler can know.

layout(local_size_x = 64) in;

struct Operands { float a, b, c; };
struct Results { float quotient, reciprocal, root, fused, product, sum; };

layout(std430, set = 0, binding = 0) readonly buffer Cases { Operands cases[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Answers { Results answers[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= cases.length()) return;
    Operands x = cases[i];
    answers[i] = Results(x.a / x.b, 1.0 / x.b, sqrt(x.a), fma(x.a, x.b, x.c), x.a * x.b, x.a + x.c);
}
