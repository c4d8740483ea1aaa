#version 460
#extension GL_GOOGLE_include_directive : require
// As schedule, for the lanes of a software driver.
#define CPU_LANES
#define TREE_TEXELS 8
#include "schedule.glsl"
