#version 460
#extension GL_GOOGLE_include_directive : require
// As migrate, for the lanes of a software driver.
#define CPU_LANES
#include "migrate.glsl"
