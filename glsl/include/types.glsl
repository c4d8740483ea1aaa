// Structs shared with the host: src/trace/mod.rs, src/bvh/layout.rs, src/render/layout.rs.
// tests/layout.rs compares the offsets.
#ifndef TYPES_GLSL
#define TYPES_GLSL
#include "shared.glsl"

struct Ray {
    vec3 origin;
    float t_min;
    vec3 direction;
    float t_max;
};

struct Hit {
    float t;
    uint prim;
    float u;
    float v;
};

struct RayCounters {
    uint node_visits;
    uint triangle_tests;
};

struct Node {
    vec4 x;
    vec4 y;
    vec4 z;
    uvec2 child;
    uvec2 pad;
};

struct Triangle {
    vec3 v0;
    uint prim;
    vec3 v1;
    uint pad1;
    vec3 v2;
    uint pad2;
};
#endif
