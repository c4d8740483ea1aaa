#version 460
#extension GL_GOOGLE_include_directive : require
// The benchmark's secondary rays: one from each hit, about the geometric normal, whatever the material.
#include "random.glsl"
#include "sampling.glsl"
#include "surface.glsl"

layout(set = 0, binding = 3, std430) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 4, std430) readonly buffer Hits { Hit hits[]; };
layout(set = 0, binding = 5, std430) writeonly buffer SecondaryRays { Ray secondary_rays[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= push.count) return;
    Ray ray = rays[i];
    Hit hit = hits[i];
    Ray next = Ray(vec3(0.0), 0.0, vec3(0.0, 0.0, 1.0), -1.0);
    if (ray.t_max >= ray.t_min && hit.prim != NO_HIT) {
        Surface s = surface_at(ray, hit);
        vec3 direction = push.argument == KIND_REFLECT
            ? normalize3(ray.direction - s.geometric * (2.0 * dot3(ray.direction, s.geometric)))
            : cosine_direction(s.geometric, random2(frame.seed, push.first + i, DIMENSION_DIRECTION, push.sample_index));
        next = Ray(s.position, 0.0, direction, push.argument == KIND_AO ? frame.ao_radius : FAR_AWAY);
    }
    secondary_rays[i] = next;
}
