// Conservative ray-box test (Ize 2013, with the slack of Woop, Benthin and Wald 2013): it never misses
// a box that holds a triangle which the triangle test would hit.
#ifndef BOX_GLSL
#define BOX_GLSL
#include "types.glsl"
#include "vec.glsl"

// A ray prepared for box tests. Low planes are measured from `low_origin`, high planes from
// `high_origin`: the origin moved up and down by the slack, which is the box grown by it.
struct BoxRay {
    vec3 low_origin;
    vec3 high_origin;
    vec3 inverse;
};

BoxRay box_ray(Ray ray, vec3 scene_low, vec3 scene_high) {
    vec3 o = ray.origin, d = ray.direction;
    float reach = max(max3(abs(scene_low - o)), max3(abs(scene_high - o)));
    vec3 slack = vec3(reach * BOX_SLACK) + abs(o) * ORIGIN_SLACK;
    vec3 floored = vec3(d.x < 0.0 ? -DIRECTION_FLOOR : DIRECTION_FLOOR, d.y < 0.0 ? -DIRECTION_FLOOR : DIRECTION_FLOOR,
                        d.z < 0.0 ? -DIRECTION_FLOOR : DIRECTION_FLOOR);
    d = vec3(abs(d.x) < DIRECTION_FLOOR ? floored.x : d.x, abs(d.y) < DIRECTION_FLOOR ? floored.y : d.y,
             abs(d.z) < DIRECTION_FLOOR ? floored.z : d.z);
    return BoxRay(o + slack, o - slack, exact_rcp3(d));
}

// Smaller and larger of two numbers of which neither is NaN. Software drivers guard the built-ins against
// NaN with two more instructions each; 1.05x on lavapipe 25.
#ifdef CPU_LANES
float lower(float a, float b) { return a < b ? a : b; }
float higher(float a, float b) { return a > b ? a : b; }
#else
float lower(float a, float b) { return min(a, b); }
float higher(float a, float b) { return max(a, b); }
#endif

// Distances (enter, leave) of the ray in the box; it meets the box if enter <= leave. The slack moves
// low planes down and high planes up, so near and far planes need no telling apart before min and max.
vec2 box_span(BoxRay ray, vec3 low, vec3 high, float t_min, float t_max) {
    vec3 a = (low - ray.low_origin) * ray.inverse;
    vec3 b = (high - ray.high_origin) * ray.inverse;
    float near = higher(higher(lower(a.x, b.x), lower(a.y, b.y)), lower(a.z, b.z));
    float far = lower(lower(higher(a.x, b.x), higher(a.y, b.y)), higher(a.z, b.z));
    float enter = higher(near, t_min);
    float leave = lower(far * FAR_PADDING, t_max);
    return vec2(enter, leave);
}
#endif
