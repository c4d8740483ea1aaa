// Base-colour textures: bilinear, decoded from sRGB before filtering, in the kernel's own arithmetic,
// because a driver's sampler may round as it likes.
#ifndef TEXTURE_GLSL
#define TEXTURE_GLSL
#include "frame.glsl"
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

layout(constant_id = SPEC_TEXTURES) const bool HAS_TEXTURES = true;

layout(set = 0, binding = 2, std430) readonly buffer Textures { Texture textures[]; };
layout(buffer_reference, std430, buffer_reference_align = 4) readonly buffer Texels { uint at[]; };
layout(buffer_reference, std430, buffer_reference_align = 4) readonly buffer Floats { float at[]; };
layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer Uvs { vec2 at[]; };

// A texture coordinate brought near 0..1 (near 0..2, one period, for repeats) without changing what it
// samples, so that it fits an integer of texels.
float reduced(float u, uint mode) { return mode == WRAP_CLAMP ? clamp(u, -1.0, 2.0) : u - 2.0 * floor(u * 0.5); }

// Texel column or row, brought into 0..size-1.
uint wrapped(int i, int size, uint mode) {
    if (mode == WRAP_CLAMP) return uint(clamp(i, 0, size - 1));
    int period = mode == WRAP_MIRROR ? 2 * size : size;
    int k = (i + period) % period; // i >= -1: never negative
    return uint(k < size ? k : period - 1 - k);
}

vec3 texel(Texture t, int x, int y) {
    uint column = wrapped(x, int(t.width), t.wrap & 3u), row = wrapped(y, int(t.height), t.wrap >> 2);
    uint packed = Texels(frame.texels).at[t.first + row * t.width + column];
    Floats linear = Floats(frame.srgb);
    return vec3(linear.at[packed & 255u], linear.at[(packed >> 8) & 255u], linear.at[(packed >> 16) & 255u]);
}

vec3 texture_color(uint index, uint prim, vec3 weights) {
    if (!HAS_TEXTURES || index == NO_TEXTURE) return vec3(1.0);
    Texture t = textures[index];
    Uvs uvs = Uvs(frame.uvs);
    vec2 uv = (uvs.at[3u * prim] * weights.x + uvs.at[3u * prim + 1u] * weights.y) + uvs.at[3u * prim + 2u] * weights.z;
    vec2 p = vec2(reduced(uv.x, t.wrap & 3u) * float(t.width) - 0.5, reduced(uv.y, t.wrap >> 2) * float(t.height) - 0.5);
    vec2 corner = floor(p), f = p - corner;
    int x = int(corner.x), y = int(corner.y);
    vec3 top = texel(t, x, y) * (1.0 - f.x) + texel(t, x + 1, y) * f.x;
    vec3 bottom = texel(t, x, y + 1) * (1.0 - f.x) + texel(t, x + 1, y + 1) * f.x;
    return top * (1.0 - f.y) + bottom * f.y;
}
#endif
