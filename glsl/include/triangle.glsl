// Watertight ray-triangle test (Woop, Benthin and Wald 2013): the triangle is moved to the ray's origin
// and sheared so that the ray runs along one axis; what is left are signs of 2x2 determinants, which two
// triangles compute alike for a shared edge.
#ifndef TRIANGLE_GLSL
#define TRIANGLE_GLSL
#include "box.glsl"

// Axis 2 is the one in which the direction is largest.
struct Shear {
    uint axis;
    vec3 shear;
};

// v with component `axis` and the last swapped. That mirrors the triangle, which changes the sign of all
// three edge functions and of nothing that is made of them.
vec3 turned(vec3 v, uint axis) {
    return vec3(axis == 0u ? v.z : v.x, axis == 1u ? v.z : v.y, axis == 0u ? v.x : axis == 1u ? v.y : v.z);
}

Shear shear_of(vec3 direction) {
    vec3 size = abs(direction);
    uint axis = size.x > size.y ? (size.x > size.z ? 0u : 2u) : (size.y > size.z ? 1u : 2u);
    vec3 d = turned(direction, axis);
    float inverse = exact_rcp(d.z);
    return Shear(axis, vec3(floored(d.x * inverse, SHEAR_FLOOR), floored(d.y * inverse, SHEAR_FLOOR), inverse));
}

// A corner relative to the ray: sheared x and y, and unscaled z.
vec3 sheared(vec3 corner, Ray ray, Shear shear) {
    vec3 p = turned(corner - ray.origin, shear.axis);
    return vec3(p.xy - shear.shear.xy * p.z, p.z);
}

// Edge function a.x b.y - a.y b.x. Rounding is monotone, so a difference of rounded products has the right sign
// unless it is zero or too small to trust; then `refined` decides.
float edge(vec3 a, vec3 b) { return a.x * b.y - a.y * b.x; }

// The same from the rounding errors of its products; see EDGE_FLOOR and PRODUCT_FLOOR.
float refined(float value, vec3 a, vec3 b) {
    if (abs(value) > EDGE_FLOOR) return value;
    float p = a.x * b.y, q = a.y * b.x;
    return abs(p) < PRODUCT_FLOOR ? 0.0 : product_error(a.x, b.y, p) - product_error(a.y, b.x, q);
}

// Whether edge functions of both signs are larger than `least`.
bool outside(float u, float v, float w, float least) {
    return min(min(u, v), w) < -least && max(max(u, v), w) > least;
}

// Takes the triangle if it is hit nearer than `hit`, or as near with a lower primitive id.
void intersect(Ray ray, BoxRay box, Shear shear, Triangle triangle, inout Hit hit) {
    vec3 a = sheared(triangle.v0, ray, shear);
    vec3 b = sheared(triangle.v1, ray, shear);
    vec3 c = sheared(triangle.v2, ray, shear);
    float u = edge(c, b), v = edge(a, c), w = edge(b, a);
    if (outside(u, v, w, EDGE_FLOOR)) return;
    if (min(min(abs(u), abs(v)), abs(w)) <= EDGE_FLOOR) {
        u = refined(u, c, b), v = refined(v, a, c), w = refined(w, b, a);
        if (outside(u, v, w, 0.0)) return;
    }
    float det = u + v + w;
    if (det == 0.0) return;
    float inverse = exact_rcp(det);
    // Weights first: u a.z is cubic in the size of the scene and would overflow early.
    u = floored(u * inverse, EDGE_FLOOR), v = floored(v * inverse, EDGE_FLOOR), w = floored(w * inverse, EDGE_FLOOR);
    float t = floored(((u * a.z + v * b.z) + w * c.z) * shear.shear.z, COORDINATE_FLOOR);
    if (t < ray.t_min || t > hit.t) return;
    // A hit is in its own box and never nearer than it. Boxes nest, so no box on the way to this triangle can
    // be missed or skipped because of a farther hit, and the answer does not depend on the order of visits.
    vec3 low = min(min(triangle.v0, triangle.v1), triangle.v2);
    vec3 high = max(max(triangle.v0, triangle.v1), triangle.v2);
    vec2 span = box_span(box, low, high, ray.t_min, ray.t_max);
    t = abs(max(t, span.x)); // abs: of two zeros max may return either
    if (span.x <= span.y && (t < hit.t || (t == hit.t && triangle.prim < hit.prim))) {
        hit = Hit(t, triangle.prim, v, w);
    }
}
#endif
