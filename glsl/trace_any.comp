#version 460
#extension GL_GOOGLE_include_directive : require
// Whether each ray meets anything between its t_min and t_max.
#define ANY_HIT true
#include "trace.glsl"
