#version 460
#extension GL_GOOGLE_include_directive : require
// As persistent, for the lanes of a software driver.
#define CPU_LANES
#define NODE_TEXELS 7
#define TRIANGLE_TEXELS 8
#include "persistent.glsl"
