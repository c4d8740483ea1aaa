#version 460
#extension GL_GOOGLE_include_directive : require
// Strategy `migrate`, second stage: rays at the SMs that own their subtrees.
#include "migrate.glsl"
