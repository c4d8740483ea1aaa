#version 460
#extension GL_GOOGLE_include_directive : require
// A shadow ray from each hit towards one light, or an ambient occlusion ray, and what it brings if nothing
// is in its way.
#define RAY_COUNTS_BINDING 9
#include "counts.glsl"
#include "material.glsl"
#include "random.glsl"
#include "sampling.glsl"

layout(set = 0, binding = 3, std430) readonly buffer Lights { Light lights[]; };
layout(set = 0, binding = 4, std430) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 5, std430) readonly buffer Hits { Hit hits[]; };
layout(set = 0, binding = 6, std430) readonly buffer Paths { Path paths[]; };
layout(set = 0, binding = 7, std430) writeonly buffer ShadowRays { Ray shadow_rays[]; };
layout(set = 0, binding = 8, std430) writeonly buffer Contributions { Contribution contributions[]; };

const float INVERSE_PI = 0.3183098861837907;

// Light that arrives at a point: from where, how much, and how far away the light is.
struct Arrival {
    vec3 direction;
    float distance;
    vec3 irradiance; // on a surface that faces it
};

Arrival arrival(Light light, vec3 point) {
    if (light.kind == LIGHT_DIRECTIONAL) return Arrival(-light.direction, FAR_AWAY, light.intensity);
    vec3 to = light.position - point;
    float distance2 = dot3(to, to);
    if (distance2 < SQRT_FLOOR) return Arrival(vec3(0.0), 0.0, vec3(0.0));
    float distance = exact_sqrt(distance2);
    vec3 direction = to * exact_rcp(distance);
    // The window of KHR_lights_punctual, section Range Property.
    float relative = distance * light.inverse_range;
    float relative2 = relative * relative;
    float fade = max(1.0 - relative2 * relative2, 0.0) * exact_rcp(distance2);
    if (light.kind == LIGHT_SPOT) {
        float cone = clamp(-dot3(direction, light.direction) * light.angle_scale + light.angle_offset, 0.0, 1.0);
        fade = fade * (cone * cone);
    }
    return Arrival(direction, distance, light.intensity * fade);
}

bool is_black(vec3 c) { return max3(c) <= 0.0; }

// Ray towards the light; dead if it could bring nothing.
Ray shadow_ray(Surface s, Light light, vec3 weight, out vec3 brought) {
    Arrival a = arrival(light, s.position);
    float cosine = dot3(s.normal, a.direction);
    brought = weight * a.irradiance * (cosine * INVERSE_PI);
    bool useful = cosine > 0.0 && dot3(s.geometric, a.direction) > 0.0 && !is_black(brought);
    return Ray(s.position, 0.0, a.direction, useful ? a.distance : -1.0);
}

Ray ambient_ray(Surface s, vec3 weight, Path path, out vec3 brought) {
    uint dimension = DIMENSION_AO + (path.state & PATH_DEPTH_MASK) * DIMENSIONS;
    vec3 direction = cosine_direction(s.geometric, random2(frame.seed, path.pixel, dimension, push.sample_index));
    brought = weight * frame.ambient;
    return Ray(s.position, 0.0, direction, is_black(brought) ? -1.0 : frame.ao_radius);
}

void main() {
    begin_counts();
    uint i = gl_GlobalInvocationID.x;
    if (i < push.count) {
        Ray ray = rays[i];
        Hit hit = hits[i];
        Ray shadow = Ray(vec3(0.0), 0.0, vec3(0.0, 0.0, 1.0), -1.0);
        vec3 brought = vec3(0.0);
        if (ray.t_max >= ray.t_min && hit.prim != NO_HIT) {
            Surface s = surface_at(ray, hit);
            Path path = paths[i];
            vec3 weight = path.throughput * diffuse_color(s);
            shadow = push.argument == LIGHT_AMBIENT ? ambient_ray(s, weight, path, brought)
                                                    : shadow_ray(s, lights[push.argument], weight, brought);
            if (shadow.t_max >= 0.0) count_ray(push.argument == LIGHT_AMBIENT ? KIND_AO : KIND_SHADOW);
        }
        shadow_rays[i] = shadow;
        contributions[i] = Contribution(brought, 0u);
    }
    end_counts();
}
