#version 460
#extension GL_GOOGLE_include_directive : require
// Nearest hit of each ray.
#define ANY_HIT false
#include "trace.glsl"
