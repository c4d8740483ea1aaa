#version 460
#extension GL_GOOGLE_include_directive : require
// Strategy `persistent`.
#include "persistent.glsl"
