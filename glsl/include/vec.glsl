// Vector arithmetic in a fixed order of operations; the built-ins leave the order to the driver.
#ifndef VEC_GLSL
#define VEC_GLSL
#include "exact.glsl"

float dot3(vec3 a, vec3 b) { return (a.x * b.x + a.y * b.y) + a.z * b.z; }

vec3 cross3(vec3 a, vec3 b) {
    return vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

float max3(vec3 v) { return max(max(v.x, v.y), v.z); }

// Numbers below `least` in magnitude as zero.
float floored(float x, float least) { return abs(x) < least ? 0.0 : x; }

vec3 floored3(vec3 v, float least) { return vec3(floored(v.x, least), floored(v.y, least), floored(v.z, least)); }

// Unit vector along v, or zero if v is zero or too short to tell (VECTOR_FLOOR). Scaled by its largest
// component first, so that neither tiny nor huge vectors underflow or overflow.
vec3 normalize3(vec3 v) {
    float largest = max3(abs(v));
    if (largest < VECTOR_FLOOR) return vec3(0.0);
    v *= exact_rcp(largest);
    return v * exact_rcp(exact_sqrt(dot3(v, v)));
}
#endif
