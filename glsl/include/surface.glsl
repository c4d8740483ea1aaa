// The surface at a hit: point, normals, material and colour.
#ifndef SURFACE_GLSL
#define SURFACE_GLSL
#include "frame.glsl"
#include "geometry.glsl"
#include "texture.glsl"
#include "vec.glsl"

layout(constant_id = SPEC_NORMALS) const bool HAS_NORMALS = true;

layout(set = 0, binding = 1, std430) readonly buffer Materials { Material materials[]; };

layout(buffer_reference, std430, buffer_reference_align = 4) readonly buffer Words { uint at[]; };

struct Surface {
    vec3 position; // moved off the surface to the side that the ray came from
    vec3 below; // moved off to the other side
    vec3 geometric; // unit normal on the ray's side
    vec3 normal; // unit shading normal on the ray's side
    vec3 color;
    Material material;
    bool front; // the ray met the side from which the corners run counter-clockwise
};

// Octahedral decoding (Cigolle et al. 2014) of a normal in two signed 16-bit numbers.
vec3 decode_normal(uint packed) {
    float x = float(int(packed << 16) >> 16) * 3.0518509475997192e-5;
    float y = float(int(packed) >> 16) * 3.0518509475997192e-5;
    float z = 1.0 - abs(x) - abs(y);
    float fold = max(-z, 0.0);
    return normalize3(vec3(x < 0.0 ? x + fold : x - fold, y < 0.0 ? y + fold : y - fold, z));
}

vec3 shading_normal(uint prim, vec3 weights, vec3 geometric) {
    if (!HAS_NORMALS) return geometric;
    Words packed = Words(frame.normals);
    vec3 n = (decode_normal(packed.at[3u * prim]) * weights.x + decode_normal(packed.at[3u * prim + 1u]) * weights.y) +
             decode_normal(packed.at[3u * prim + 2u]) * weights.z;
    n = normalize3(n);
    float side = dot3(n, geometric);
    return side > 0.0 ? n : side < 0.0 ? -n : geometric;
}

Surface surface_at(Ray ray, Hit hit) {
    Triangle triangle = load_triangle(Triangles(frame.triangles), Words(frame.slots).at[hit.prim]);
    vec3 weights = vec3((1.0 - hit.u) - hit.v, hit.u, hit.v);
    vec3 point = (triangle.v0 * weights.x + triangle.v1 * weights.y) + triangle.v2 * weights.z;
    vec3 geometric = normalize3(cross3(triangle.v1 - triangle.v0, triangle.v2 - triangle.v0));
    bool front = dot3(geometric, ray.direction) <= 0.0;
    if (!front) geometric = -geometric;
    float size = max(max(max3(abs(triangle.v0)), max3(abs(triangle.v1))), max3(abs(triangle.v2)));
    vec3 offset = geometric * (size * SURFACE_OFFSET);

    Surface surface;
    surface.position = floored3(point + offset, COORDINATE_FLOOR);
    surface.below = floored3(point - offset, COORDINATE_FLOOR);
    surface.geometric = geometric;
    surface.normal = shading_normal(hit.prim, weights, geometric);
    surface.material = materials[Words(frame.material_ids).at[hit.prim]];
    surface.color = surface.material.base_color * texture_color(surface.material.texture, hit.prim, weights);
    surface.front = front;
    return surface;
}
#endif
