#version 460
#extension GL_GOOGLE_include_directive : require
// As trace_closest, for the lanes of a software driver.
#define ANY_HIT false
#define CPU_LANES
#define NODE_TEXELS 5
#define TRIANGLE_TEXELS 6
#include "trace.glsl"
