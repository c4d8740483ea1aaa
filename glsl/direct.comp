#version 460
#extension GL_GOOGLE_include_directive : require
// Strategy `direct`.
#include "direct.glsl"
