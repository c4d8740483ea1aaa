#version 460
#extension GL_GOOGLE_include_directive : require
// Strategy `migrate`, first stage: where each ray must go.
#include "schedule.glsl"
