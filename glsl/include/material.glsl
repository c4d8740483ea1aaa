// How a surface passes light on: glTF's metallic-roughness material as a Whitted-style mixture of mirror,
// glass and Lambertian reflection (Whitted 1980). Features that no material of the scene has are compiled
// out.
#ifndef MATERIAL_GLSL
#define MATERIAL_GLSL
#include "surface.glsl"

layout(constant_id = SPEC_MIRRORS) const bool HAS_MIRRORS = true;
layout(constant_id = SPEC_GLASS) const bool HAS_GLASS = true;
layout(constant_id = SPEC_EMISSION) const bool HAS_EMISSION = true;
layout(constant_id = SPEC_UNLIT) const bool HAS_UNLIT = true;
layout(constant_id = SPEC_INDIRECT) const uint INDIRECT = INDIRECT_AO;

bool is_unlit(Material m) { return HAS_UNLIT && (m.flags & MATERIAL_UNLIT) != 0u; }

// Share of the light that the Lambertian part reflects.
vec3 diffuse_color(Surface s) {
    if (is_unlit(s.material)) return vec3(0.0);
    float share = 1.0;
    if (HAS_MIRRORS) share = share * (1.0 - s.material.metallic);
    if (HAS_GLASS) share = share * (1.0 - s.material.transmission);
    return s.color * share;
}

vec3 reflected(vec3 d, vec3 n) { return d - n * (2.0 * dot3(d, n)); }

// Schlick 1994: the share that a metal of colour f0 reflects at this cosine.
vec3 schlick(vec3 f0, float cosine) {
    float m = max(1.0 - cosine, 0.0);
    float m2 = m * m;
    return f0 + (vec3(1.0) - f0) * (m2 * m2 * m);
}

// Fresnel reflectance of unpolarised light between dielectrics; `eta` is the index on the ray's side over
// the other's. 1 where all is reflected.
float dielectric(float cosine, float eta) {
    float sine2 = eta * eta * (1.0 - cosine * cosine);
    if (sine2 >= 1.0) return 1.0;
    float inner = exact_sqrt(1.0 - sine2);
    float s = (eta * cosine - inner) * exact_rcp(eta * cosine + inner);
    float p = (cosine - eta * inner) * exact_rcp(cosine + eta * inner);
    return (s * s + p * p) * 0.5;
}

// Snell's direction; only where `dielectric` is below 1.
vec3 refracted(vec3 d, vec3 n, float cosine, float eta) {
    float inner = exact_sqrt(max(1.0 - eta * eta * (1.0 - cosine * cosine), 0.0));
    return normalize3(d * eta + n * (eta * cosine - inner));
}
#endif
