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
    float steps = float(counters[i].node_visits);
    if (ray.t_max < ray.t_min || hit.prim == NO_HIT) {
        aovs[i] = AovPixel(vec3(0.0), Z_NOTHING, vec3(0.0), NO_HIT, vec3(0.0), steps);
        return;
    }
    Surface s = surface_at(ray, hit);
    vec3 position = ray.origin + ray.direction * hit.t;
    float z = dot3(position - frame.camera_origin, frame.camera_forward);
    aovs[i] = AovPixel(s.normal, z, s.color, hit.prim, position, steps);
}
