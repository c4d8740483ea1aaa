#version 460
#extension GL_GOOGLE_include_directive : require
// As schedule, for the lanes of a software driver.
#define CPU_LANES
#define NODE_TEXELS 8
#define TRIANGLE_TEXELS 9
#define TOP_TEXELS 10
#include "schedule.glsl"
