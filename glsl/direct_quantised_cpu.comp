#version 460
#extension GL_GOOGLE_include_directive : require
// As direct_cpu, on quantised nodes.
#define QUANTISED
#define CPU_LANES
#define NODE_TEXELS 7
#define TRIANGLE_TEXELS 8
#include "direct.glsl"
