#version 460
#extension GL_GOOGLE_include_directive : require
// As trace_any, for the lanes of a software driver.
#define ANY_HIT true
#define CPU_LANES
#include "trace.glsl"
