// The rays of a trace kernel, at binding 0; with CPU_LANES as texels, for the reason in geometry.glsl.
#ifndef RAY_BUFFER_GLSL
#define RAY_BUFFER_GLSL
#include "types.glsl"

#ifdef CPU_LANES
layout(set = 0, binding = 0) uniform usamplerBuffer ray_texels;

Ray load_ray(uint i) {
    vec4 from = uintBitsToFloat(texelFetch(ray_texels, int(2u * i)));
    vec4 to = uintBitsToFloat(texelFetch(ray_texels, int(2u * i + 1u)));
    return Ray(from.xyz, from.w, to.xyz, to.w);
}
#else
layout(set = 0, binding = 0, std430) readonly buffer Rays { Ray rays[]; };

Ray load_ray(uint i) { return rays[i]; }
#endif
#endif
