#version 460
// A loop whose length is data: how many of its iterations does the driver run?

layout(local_size_x = 32) in;

layout(std430, set = 0, binding = 0) readonly buffer Steps { uint steps; };
layout(std430, set = 0, binding = 1) writeonly buffer States { uint states[]; };

void main() {
    uint state = 0u;
    // A linear congruential generator has no closed form that a compiler would find (constants: Numerical Recipes).
    for (uint i = 0u; i < steps; ++i) state = state * 1664525u + 1013904223u;
    states[gl_GlobalInvocationID.x] = state;
}
