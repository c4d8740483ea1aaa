#version 460
#extension GL_GOOGLE_include_directive : require
// As direct, for the lanes of a software driver.
#define CPU_LANES
#define TREE_TEXELS 7
#include "direct.glsl"
