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
    return Shear(axis, vec3(d.x * inverse, d.y * inverse, inverse));
}

// A corner relative to the ray: sheared x and y, and unscaled z. See SHEAR_FLOOR.
vec3 sheared(vec3 corner, Ray ray, Shear shear) {
    vec3 p = turned(corner - ray.origin, shear.axis);
    vec2 xy = p.xy - shear.shear.xy * p.z;
    xy = vec2(abs(xy.x) < SHEAR_FLOOR ? 0.0 : xy.x, abs(xy.y) < SHEAR_FLOOR ? 0.0 : xy.y);
    return vec3(xy, p.z);
}

// a.x b.y - a.y b.x. Rounding is monotone, so a difference of rounded products has the right sign unless
// it is zero; then the rounding errors of the products decide.
float determinant(vec3 a, vec3 b) { return a.x * b.y - a.y * b.x; }

float determinant_of_errors(vec3 a, vec3 b) {
    float difference = product_error(a.x, b.y, a.x * b.y) - product_error(a.y, b.x, a.y * b.x);
    return abs(difference) < DETERMINANT_FLOOR ? 0.0 : difference;
}

bool outside(float u, float v, float w) { return min(min(u, v), w) < 0.0 && max(max(u, v), w) > 0.0; }

// Takes the triangle if it is hit nearer than `hit`, or as near with a lower primitive id.
void intersect(Ray ray, BoxRay box, Shear shear, Triangle triangle, inout Hit hit) {
    vec3 a = sheared(triangle.v0, ray, shear);
    vec3 b = sheared(triangle.v1, ray, shear);
    vec3 c = sheared(triangle.v2, ray, shear);
    float u = determinant(c, b), v = determinant(a, c), w = determinant(b, a);
    if (outside(u, v, w)) return;
    if (u == 0.0 || v == 0.0 || w == 0.0) {
        u = u == 0.0 ? determinant_of_errors(c, b) : u;
        v = v == 0.0 ? determinant_of_errors(a, c) : v;
        w = w == 0.0 ? determinant_of_errors(b, a) : w;
        if (outside(u, v, w)) return;
    }
    float det = u + v + w;
    if (abs(det) < DETERMINANT_FLOOR) return;
    float inverse = exact_rcp(det);
    // Weights first: u a.z is cubic in the size of the scene and would overflow early.
    u *= inverse, v *= inverse, w *= inverse;
    float t = ((u * a.z + v * b.z) + w * c.z) * shear.shear.z;
    if (t < ray.t_min || t > hit.t) return;
    // A hit is never nearer than its own box. Boxes nest, so no box on the way to this triangle can be
    // skipped because of a farther hit, and the answer does not depend on the order of visits.
    vec3 low = min(min(triangle.v0, triangle.v1), triangle.v2);
    vec3 high = max(max(triangle.v0, triangle.v1), triangle.v2);
    vec2 span = box_span(box, low, high, ray.t_min, ray.t_max);
    t = abs(max(t, span.x)); // abs: of two zeros max may return either
    if (t < hit.t || (t == hit.t && triangle.prim < hit.prim)) {
        hit = Hit(t, triangle.prim, v, w);
    }
}
#endif
