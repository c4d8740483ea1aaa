#version 460
#extension GL_GOOGLE_include_directive : require
// As direct, on quantised nodes.
#define QUANTISED
#include "direct.glsl"
