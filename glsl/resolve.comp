#version 460
#extension GL_GOOGLE_include_directive : require
// Adds a sample to the pass's sums of colour, and of squared deviations of the luminance from its mean (Welford 1962,
// Note on a Method for Calculating Corrected Sums of Squares and Products).
#include "frame.glsl"
#include "vec.glsl"

layout(set = 0, binding = 1, std430) readonly buffer Paths { Path paths[]; };
layout(set = 0, binding = 2, std430) buffer Sums { vec4 sums[]; };
layout(set = 0, binding = 3, std430) buffer Spreads { float spreads[]; };

float luminance(vec3 c) { return dot3(vec3(LUMINANCE_RED, LUMINANCE_GREEN, LUMINANCE_BLUE), c); }

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= push.count) return;
    bool covered = frame.transparent == 0u || (paths[i].state & PATH_COVERED) != 0u;
    vec4 added = vec4(paths[i].radiance, covered ? 1.0 : 0.0);
    uint before = push.argument;
    if (before == 0u) {
        sums[i] = added;
        spreads[i] = 0.0;
        return;
    }
    vec4 old = sums[i];
    vec4 sum = old + added;
    float l = luminance(added.rgb);
    float from_old = l - luminance(old.rgb) * exact_rcp(float(before));
    float from_new = l - luminance(sum.rgb) * exact_rcp(float(before + 1u));
    sums[i] = sum;
    spreads[i] = spreads[i] + from_old * from_new;
}
