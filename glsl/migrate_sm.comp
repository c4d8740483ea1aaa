#version 460
#extension GL_GOOGLE_include_directive : require
// As migrate, with the number of the SM from the hardware, so that a subtree really stays with its SM.
#define HARDWARE_SM
#include "migrate.glsl"
