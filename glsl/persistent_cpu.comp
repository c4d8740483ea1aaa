#version 460
#extension GL_GOOGLE_include_directive : require
// As persistent, for the lanes of a software driver.
#define CPU_LANES
#define TREE_TEXELS 7
#include "persistent.glsl"
