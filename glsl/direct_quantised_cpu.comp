#version 460
#extension GL_GOOGLE_include_directive : require
// As direct_cpu, on quantised nodes.
#define QUANTISED
#define CPU_LANES
#define TREE_TEXELS 7
#include "direct.glsl"
