#version 460
#extension GL_GOOGLE_include_directive : require
// Camera rays and fresh paths of one sample of the pixels of chosen tiles.
#include "frame.glsl"
#include "random.glsl"
#include "tiles.glsl"
#include "vec.glsl"

layout(set = 0, binding = 1, std430) writeonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 2, std430) writeonly buffer Paths { Path paths[]; };
layout(set = 0, binding = 3, std430) readonly buffer Tiles { uint tiles[]; };

// Position on the picture plane, -1..1 to the right and up. The first sample is the pixel's middle.
vec2 film_position(uvec2 pixel, uint id) {
    vec2 jitter = push.sample_index == 0u ? vec2(0.5) : random2(frame.seed, id, DIMENSION_CAMERA, push.sample_index);
    float x = (float(pixel.x) + jitter.x) * exact_rcp(float(frame.width));
    float y = (float(pixel.y) + jitter.y) * exact_rcp(float(frame.height));
    return vec2(x * 2.0 - 1.0, 1.0 - y * 2.0);
}

Ray camera_ray(vec2 p) {
    vec3 across = frame.camera_right * p.x + frame.camera_up * p.y;
    bool parallel = frame.orthographic != 0u;
    vec3 origin = parallel ? frame.camera_origin + across : frame.camera_origin;
    vec3 direction = parallel ? frame.camera_forward : normalize3(frame.camera_forward + across);
    return Ray(floored3(origin, COORDINATE_FLOOR), 0.0, direction, FAR_AWAY);
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= push.count) return;
    uvec2 pixel = tile_pixel(tiles[(push.first + i) / WARP] * WARP + i % WARP, frame.width);
    uint id = pixel.y * frame.width + pixel.x;
    Ray ray = camera_ray(film_position(pixel, id));
    if (pixel.x >= frame.width || pixel.y >= frame.height) ray.t_max = -1.0;
    rays[i] = ray;
    paths[i] = Path(vec3(1.0), id, vec3(0.0), 0u);
}
