#version 460
#extension GL_GOOGLE_include_directive : require
// Where each path goes on from its hit: the next ray replaces the last, or the path ends.
#define RAY_COUNTS_BINDING 6
#include "counts.glsl"
#include "material.glsl"
#include "random.glsl"
#include "sampling.glsl"
#include "sky.glsl"

layout(set = 0, binding = 3, std430) buffer Rays { Ray rays[]; };
layout(set = 0, binding = 4, std430) readonly buffer Hits { Hit hits[]; };
layout(set = 0, binding = 5, std430) buffer Paths { Path paths[]; };

const uint PATH_ENDS = KINDS;

float choice(Path path, uint dimension) {
    uint bounce = path.state & PATH_DEPTH_MASK;
    return random1(frame.seed, path.pixel, bounce * DIMENSIONS + dimension, push.sample_index);
}

vec2 choice2(Path path, uint dimension) {
    uint bounce = path.state & PATH_DEPTH_MASK;
    return random2(frame.seed, path.pixel, bounce * DIMENSIONS + dimension, push.sample_index);
}

// `direction` blurred by the material's roughness: a point in a ball about its tip, of radius alpha =
// roughness squared. Falls back to the sharp direction where the blur would cross the surface.
vec3 blurred(vec3 direction, vec3 side, Surface s, Path path) {
    float alpha = s.material.roughness * s.material.roughness;
    vec3 rough = normalize3(direction + sphere_direction(choice2(path, DIMENSION_ROUGHNESS)) * alpha);
    return dot3(rough, side) > 0.0 ? rough : direction;
}

uint reflect_path(Surface s, vec3 tint, inout Ray ray, inout Path path) {
    vec3 mirror = reflected(ray.direction, s.normal);
    // Bent normals can send a reflection into the surface.
    if (dot3(mirror, s.geometric) <= 0.0) mirror = reflected(ray.direction, s.geometric);
    ray = Ray(s.position, 0.0, blurred(mirror, s.geometric, s, path), FAR_AWAY);
    path.throughput = path.throughput * tint;
    return KIND_REFLECT;
}

uint refract_path(Surface s, float cosine, float eta, inout Ray ray, inout Path path) {
    bool solid = (s.material.flags & MATERIAL_SOLID) != 0u;
    vec3 through = solid ? refracted(ray.direction, s.normal, cosine, eta) : ray.direction;
    if (dot3(through, s.geometric) >= 0.0) through = ray.direction;
    ray = Ray(s.below, 0.0, blurred(through, -s.geometric, s, path), FAR_AWAY);
    // A solid is tinted where the ray enters it, so that passing through it counts once.
    if (!solid || s.front) path.throughput = path.throughput * s.color;
    return KIND_REFRACT;
}

uint glass_path(Surface s, inout Ray ray, inout Path path) {
    float cosine = clamp(-dot3(ray.direction, s.normal), 0.0, 1.0);
    float outside = exact_rcp(s.material.ior);
    bool leaving = (s.material.flags & MATERIAL_SOLID) != 0u && !s.front;
    float eta = leaving ? s.material.ior : outside;
    if (choice(path, DIMENSION_FRESNEL) < dielectric(cosine, eta)) return reflect_path(s, vec3(1.0), ray, path);
    return refract_path(s, cosine, eta, ray, path);
}

uint diffuse_path(Surface s, inout Ray ray, inout Path path) {
    if (INDIRECT != INDIRECT_DIFFUSE || (path.state & PATH_BOUNCED) != 0u) return PATH_ENDS;
    ray = Ray(s.position, 0.0, cosine_direction(s.normal, choice2(path, DIMENSION_DIRECTION)), FAR_AWAY);
    if (dot3(ray.direction, s.geometric) <= 0.0) return PATH_ENDS;
    path.throughput = path.throughput * s.color;
    path.state |= PATH_BOUNCED;
    return KIND_DIFFUSE;
}

// Adds what the surface itself shows, and chooses the next ray; its kind, or PATH_ENDS.
uint next_ray(Surface s, inout Ray ray, inout Path path) {
    if (is_unlit(s.material)) {
        path.radiance = path.radiance + path.throughput * s.color;
        return PATH_ENDS;
    }
    // Glowing surfaces are what lamps look like; where the lamps are lights too, their light on diffuse
    // surfaces is already there.
    bool counted = frame.lit != 0u && (path.state & PATH_BOUNCED) != 0u;
    if (HAS_EMISSION && !counted) path.radiance = path.radiance + path.throughput * s.material.emissive;
    if ((path.state & PATH_DEPTH_MASK) >= frame.max_depth) return PATH_ENDS;
    if (HAS_MIRRORS && choice(path, DIMENSION_METAL) < s.material.metallic) {
        return reflect_path(s, schlick(s.color, -dot3(ray.direction, s.normal)), ray, path);
    }
    if (HAS_GLASS && choice(path, DIMENSION_TRANSMISSION) < s.material.transmission) return glass_path(s, ray, path);
    return diffuse_path(s, ray, path);
}

uint shade(uint i) {
    Ray ray = rays[i];
    if (ray.t_max < ray.t_min) return PATH_ENDS;
    Hit hit = hits[i];
    Path path = paths[i];
    bool first = (path.state & PATH_DEPTH_MASK) == 0u;
    uint kind = PATH_ENDS;
    if (hit.prim == NO_HIT) {
        if (!first || frame.transparent == 0u) path.radiance = path.radiance + path.throughput * sky(ray.direction);
    } else {
        if (first) path.state |= PATH_COVERED;
        kind = next_ray(surface_at(ray, hit), ray, path);
    }
    if (kind == PATH_ENDS) ray.t_max = -1.0;
    path.state += 1u;
    rays[i] = ray;
    paths[i] = path;
    return kind;
}

void main() {
    begin_counts();
    uint i = gl_GlobalInvocationID.x;
    if (i < push.count) {
        uint kind = shade(i);
        if (kind != PATH_ENDS) count_ray(kind);
    }
    end_counts();
}
