#version 460
#extension GL_GOOGLE_include_directive : require
// What the camera ray of each pixel's first sample met.
#include "material.glsl"

layout(set = 0, binding = 3, std430) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 4, std430) readonly buffer Hits { Hit hits[]; };
layout(set = 0, binding = 5, std430) readonly buffer Counters { RayCounters counters[]; };
layout(set = 0, binding = 6, std430) writeonly buffer Aovs { AovPixel aovs[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= push.count) return;
    Ray ray = rays[i];
    Hit hit = hits[i];
    RayCounters counted = counters[i];
    AovPixel pixel = AovPixel(vec3(0.0), Z_NOTHING, vec3(0.0), NO_HIT, vec3(0.0), float(counted.node_visits),
                              float(counted.migrations), float(counted.subtrees), 0u, 0u);
    if (ray.t_max >= ray.t_min && hit.prim != NO_HIT) {
        Surface s = surface_at(ray, hit);
        pixel.normal = s.normal;
        pixel.albedo = s.color;
        pixel.prim = hit.prim;
        pixel.position = ray.origin + ray.direction * hit.t;
        pixel.z = dot3(pixel.position - frame.camera_origin, frame.camera_forward);
    }
    aovs[i] = pixel;
}
