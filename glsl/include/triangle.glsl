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

// Depth, along axis 2, at which the ray meets the triangle's plane through the point that the weights give; that
// point's own depth, `depth`, where the ray is in the plane. A corner in place of the point would be worse for needles,
// whose normals are off. The edges are scaled by the power of two that brings their largest component to 1 or more, so
// that the normal fits a float at any unit of length.
float plane_depth(Ray ray, Shear shear, Triangle triangle, vec3 weights, float depth) {
    vec3 e = triangle.v1 - triangle.v0, f = triangle.v2 - triangle.v0;
    vec3 point = floored3((triangle.v0 - ray.origin) + (weights.y * e + weights.z * f), POINT_FLOOR);
    uint exponent = floatBitsToUint(max(max3(abs(e)), max3(abs(f)))) & 0x7F800000u;
    float scale = uintBitsToFloat(0x7F000000u - exponent);
    vec3 normal = floored3(cross3(e * scale, f * scale), NORMAL_FLOOR);
    float slope = dot3(normal, turned(vec3(shear.shear.xy, 1.0), shear.axis));
    return slope == 0.0 ? depth : dot3(normal, point) * exact_rcp(slope);
}

// Depth at which the ray meets the triangle of sheared corners a, b and c: interpolated by the weights, if
// DEPTH_CONDITION allows, which is better than 1 part in 100,000. Elsewhere the edge functions have cancelled: the ray
// grazes a triangle that is large beside the depth, or the triangle is a needle.
float hit_depth(Ray ray, Shear shear, Triangle triangle, vec3 a, vec3 b, vec3 c, vec3 weights, float inverse) {
    float depth = (weights.x * a.z + weights.y * b.z) + weights.z * c.z;
    vec3 largest = max(max(abs(a), abs(b)), abs(c));
    float range = max(max(a.z, b.z), c.z) - min(min(a.z, b.z), c.z);
    bool cancelled = largest.x * largest.y * abs(inverse) * range > DEPTH_CONDITION * abs(depth);
    return cancelled ? plane_depth(ray, shear, triangle, weights, depth) : depth;
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
    // A hit is in its own box: where rounding moves it out, it is moved back. Boxes nest, so no box on the way to
    // this triangle can be missed or skipped because of a farther hit, and the answer does not depend on the order
    // of visits.
    vec3 low = min(min(triangle.v0, triangle.v1), triangle.v2);
    vec3 high = max(max(triangle.v0, triangle.v1), triangle.v2);
    vec2 span = box_span(box, low, high, -FAR_AWAY, FAR_AWAY);
    if (span.x > span.y || span.x > hit.t) return;
    float inverse = exact_rcp(det);
    // Weights first: an edge function times a coordinate is cubic in the size of the scene and would overflow early.
    vec3 weights = floored3(vec3(u, v, w) * inverse, EDGE_FLOOR);
    float depth = hit_depth(ray, shear, triangle, a, b, c, weights, inverse);
    float t = max(min(floored(depth * shear.shear.z, COORDINATE_FLOOR), span.y), span.x);
    if (t < ray.t_min || t > hit.t) return;
    t = abs(t); // zero may be negative
    if (t < hit.t || triangle.prim < hit.prim) hit = Hit(t, triangle.prim, weights.y, weights.z);
}
#endif
