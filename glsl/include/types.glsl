// Structs shared with the host: src/layout/. tests/layout.rs compares names and offsets.
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
    uint leaf_visits;
    uint stack_operations;
    uint top_visits;
    uint top_stack_operations;
    uint climbs;
    uint subtrees;
    uint migrations;
    uint bypasses;
    uint suspensions;
    uint pad;
};
const RayCounters NOTHING_COUNTED = RayCounters(0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u);

// Where a ray stands in the tree. With the ray and its hit it makes the record of 64 bytes that travels.
struct Travel {
    uvec2 trail;
    uint link;
    uint subtree;
};

// A ray in a queue.
struct QueueEntry {
    uint ray;
    uint subtree;
};

// What became of a queue entry in a round.
struct Visit {
    uint ray;
    uint subtree;
    uint next;
    uint taken;
    RayCounters counted;
};

// Entries that the queue kernels go through, and the workgroups that it takes.
struct Batch {
    uint count;
    uint strip;
    uint tiles;
    uint tiles_y;
    uint tiles_z;
    uint sms;
    uint sms_y;
    uint sms_z;
};

// Sums over a round, for the conservation checks.
struct Round {
    uint queued;
    uint taken;
    uint pushed;
    uint ended;
    uint faults;
    uint pad0;
    uint pad1;
    uint pad2;
};

struct Node {
    vec4 x;
    vec4 y;
    vec4 z;
    uvec2 child;
    uint parent;
    uint level;
};

// A node in 32 bytes, see quantised.glsl.
struct QuantisedNode {
    vec3 origin;
    uint exponents; // biased exponents of the steps of x, y and z, a byte each; then the kinds of both children
    uint x; // planes in steps from the origin, a byte each: child 0 low, high, child 1 low, high
    uint y;
    uint z;
    uint base;
};

struct Triangle {
    vec3 v0;
    uint prim;
    vec3 v1;
    uint pad1;
    vec3 v2;
    uint pad2;
};

// A part of the tree that one SM owns.
struct Subtree {
    uint root;
    uint parent;
    uint level;
    uint owner;
};

// A warp that a virtual SM holds, or the next it will.
struct WarpSlot {
    uint warp;
    uint phase;
};

// What memory instructions of one kind did to a virtual SM's L1.
struct AccessCounts {
    uint instructions;
    uint lanes;
    uint accesses;
    uint misses;
    uint write_backs;
    uint pad0;
    uint pad1;
    uint pad2;
};

// A path in flight: a pixel's sample.
struct Path {
    vec3 throughput;
    uint pixel;
    vec3 radiance;
    uint state;
};

// What a shadow ray brings if it arrives.
struct Contribution {
    vec3 radiance;
    uint pad;
};

struct Material {
    vec3 base_color;
    float metallic;
    vec3 emissive;
    float roughness;
    float transmission;
    float ior;
    uint texture;
    uint flags;
};

// Texels from `first` on, row-major from the top, 8-bit sRGB packed as R | G << 8 | B << 16.
struct Texture {
    uint first;
    uint width;
    uint height;
    uint wrap; // of u in bits 0-1, of v in bits 2-3
};

// Spot lights fade as clamp(cos * angle_scale + angle_offset)^2 (KHR_lights_punctual, section Inner and
// Outer Cone Angles).
struct Light {
    vec3 position;
    uint kind;
    vec3 direction;
    float inverse_range;
    vec3 intensity;
    float angle_scale;
    float angle_offset;
    uint pad0;
    uint pad1;
    uint pad2;
};

// Everything that stays the same over a picture.
struct Frame {
    vec3 camera_origin;
    uint width;
    vec3 camera_right; // from the middle of the picture to its right edge, at distance 1
    uint height;
    vec3 camera_up; // likewise to the top edge
    uint orthographic;
    vec3 camera_forward;
    uint seed;
    vec3 sky_zenith;
    float ao_radius;
    vec3 sky_horizon;
    uint max_depth;
    vec3 ambient;
    uint transparent; // the sky does not show, pixels carry coverage as alpha
    uint lit; // the scene has punctual lights
    uint pad0;
    uvec2 triangles;
    uvec2 slots; // of each primitive: its place in triangles
    uvec2 material_ids;
    uvec2 normals;
    uvec2 uvs;
    uvec2 texels;
    uvec2 srgb; // linear value of each 8-bit sRGB value
};

// First hit of a pixel's first sample.
struct AovPixel {
    vec3 normal;
    float z;
    vec3 albedo;
    uint prim;
    vec3 position;
    float steps;
    float migrations;
    float subtrees;
    uint pad0;
    uint pad1;
};
#endif
