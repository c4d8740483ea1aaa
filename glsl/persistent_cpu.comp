#version 460
#extension GL_GOOGLE_include_directive : require
// As persistent, for the lanes of a software driver; by address, since lavapipe 25 crashes on its texel fetches.
#define CPU_LANES
#include "persistent.glsl"
