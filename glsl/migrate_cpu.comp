#version 460
#extension GL_GOOGLE_include_directive : require
// As migrate, for the lanes of a software driver.
#define CPU_LANES
#define TREE_TEXELS 8
#define HIT_TEXELS 9
#define TRAVEL_TEXELS 10
#include "migrate.glsl"
