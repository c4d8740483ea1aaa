// The sky: a gradient from the horizon up; below the horizon it is the horizon's.
#ifndef SKY_GLSL
#define SKY_GLSL
#include "frame.glsl"

vec3 sky(vec3 direction) {
    float height = max(direction.y, 0.0);
    return frame.sky_horizon * (1.0 - height) + frame.sky_zenith * height;
}
#endif
