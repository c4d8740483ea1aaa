// Random numbers by hashing: no state, so any kernel can ask for any dimension of any sample.
#ifndef RANDOM_GLSL
#define RANDOM_GLSL
#include "shared.glsl"

// PCG hash (Jarzynski and Olano 2020, Hash Functions for GPU Rendering).
uint pcg(uint v) {
    uint state = v * 747796405u + 2891336453u;
    uint word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

float unit_float(uint bits) { return float(bits >> 8) * 5.9604644775390625e-8; }

uint dimension_hash(uint seed, uint pixel, uint dimension) { return pcg(pcg(pixel + pcg(seed)) + dimension); }

// One coordinate of sample `index`: the golden-ratio sequence, turned by a hash (Cranley and Patterson 1976).
float random1(uint seed, uint pixel, uint dimension, uint index) {
    return unit_float(dimension_hash(seed, pixel, dimension) + index * 0x9E3779B9u);
}

// Two coordinates of sample `index`: the R2 sequence (Roberts 2018), turned likewise.
vec2 random2(uint seed, uint pixel, uint dimension, uint index) {
    return vec2(unit_float(dimension_hash(seed, pixel, dimension) + index * 0xC13FA9A9u),
                unit_float(dimension_hash(seed, pixel, dimension + 1u) + index * 0x91E10DA6u));
}
#endif
