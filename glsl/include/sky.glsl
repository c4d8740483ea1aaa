// The sky: a gradient over the height of the direction.
#ifndef SKY_GLSL
#define SKY_GLSL
#include "frame.glsl"

vec3 sky(vec3 direction) {
    float height = (direction.y + 1.0) * 0.5;
    return frame.sky_horizon * (1.0 - height) + frame.sky_zenith * height;
}
#endif
