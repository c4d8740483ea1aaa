// Directions from random numbers, by additions and products alone: sin and cos differ between drivers.
#ifndef SAMPLING_GLSL
#define SAMPLING_GLSL
#include "vec.glsl"

// Cosine and sine of x quarter turns, |x| <= 1/2: Taylor series to x^10 and x^9, error below 1e-8.
vec2 quarter_cos_sin(float x) {
    float y = x * 1.5707963267948966, z = y * y;
    float c = 1.0 + z * (-0.5 + z * (0.041666666666666664 + z * (-0.001388888888888889 + z * (2.48015873015873e-5 + z * -2.755731922398589e-7))));
    float s = y * (1.0 + z * (-0.16666666666666666 + z * (0.008333333333333333 + z * (-0.0001984126984126984 + z * 2.7557319223985893e-6))));
    return vec2(c, s);
}

// Cosine and sine of u turns, 0 <= u < 1.
vec2 turn_cos_sin(float u) {
    float quarters = u * 4.0;
    uint nearest = uint(quarters + 0.5);
    vec2 p = quarter_cos_sin(quarters - float(nearest));
    uint quadrant = nearest & 3u;
    if (quadrant == 1u) return vec2(-p.y, p.x);
    if (quadrant == 2u) return vec2(-p.x, -p.y);
    if (quadrant == 3u) return vec2(p.y, -p.x);
    return p;
}

// Cosine-weighted direction about the unit vector n; the basis is Duff et al. 2017.
vec3 cosine_direction(vec3 n, vec2 u) {
    vec2 turn = turn_cos_sin(u.y);
    float r = exact_sqrt(u.x);
    float x = r * turn.x, y = r * turn.y, z = exact_sqrt(max(1.0 - u.x, 0.0));
    float side = n.z < 0.0 ? -1.0 : 1.0;
    float a = -exact_rcp(side + n.z);
    float b = n.x * n.y * a;
    vec3 tangent = vec3(1.0 + side * n.x * n.x * a, side * b, -side * n.x);
    vec3 bitangent = vec3(b, side + n.y * n.y * a, -n.y);
    return normalize3(tangent * x + bitangent * y + n * z);
}

// Uniform direction on the unit sphere.
vec3 sphere_direction(vec2 u) {
    vec2 turn = turn_cos_sin(u.y);
    float z = 1.0 - 2.0 * u.x;
    float r = exact_sqrt(max(1.0 - z * z, 0.0));
    return vec3(r * turn.x, r * turn.y, z);
}
#endif
