// Facts shared by host and kernels. build.rs turns every `const` line into a Rust constant of the
// same name in `caribou::shared`, so there is no second place to keep in step.
#ifndef SHARED_GLSL
#define SHARED_GLSL

// Child link: a leaf has this bit set; an inner child is the index of its node.
const uint LEAF_BIT = 0x80000000u;
// A leaf's triangle count sits from this bit up; an empty leaf has count 0.
const uint LEAF_COUNT_SHIFT = 27u;
// Mask of a leaf's triangle count after the shift.
const uint LEAF_COUNT_MASK = 15u;
// Mask of a leaf's first triangle; its size limits a scene to 134 million triangles.
const uint LEAF_FIRST_MASK = 0x07FFFFFFu;
// Link that ends a traversal: reads as a leaf of 15 triangles, more than any leaf holds.
const uint LINK_DONE = 0xFFFFFFFFu;
// Link from the top tree to a subtree, whose index is added: reads as a leaf of 14 triangles, more than any holds.
const uint SUBTREE_LINK = 0xF0000000u;
// Most triangles a leaf may hold.
const uint MAX_LEAF_TRIANGLES = 8u;
// Entries of the traversal stack, and bits of a trail; the builder makes no deeper trees.
const uint STACK_SIZE = 64u;
// In a step trace: one of the node's children was put off. Node indices are below it.
const uint STEP_PUSHED = 0x40000000u;

// In a quantised node, the kind of a child that is an inner node; other kinds are a leaf's triangle count.
const uint QUANTISED_INNER = 15u;
// The kinds of its children sit in the top byte of its exponents, from these bits up.
const uint QUANTISED_KIND0_SHIFT = 24u;
// See QUANTISED_KIND0_SHIFT.
const uint QUANTISED_KIND1_SHIFT = 28u;

// Most bits of a subtree's index that one pass of the queue sort goes by (glsl/include/queue.glsl): its columns of
// counts then fill the 32 KiB of shared memory that common drivers have.
const uint MOST_DIGIT_BITS = 8u;
// Most values of a digit: 2^MOST_DIGIT_BITS.
const uint MOST_DIGITS = 256u;
// Most workgroups of the queue kernels. One workgroup sums up what they count: with twice as many an H100 takes a tenth
// longer for all of the dragon's tracing.
const uint MOST_TILES = 256u;
// Fewest entries that an invocation of the queue kernels goes through on a GPU, where short queues had better spread.
const uint LEAST_STRIP = 32u;
// Invocations of the prefix-sum kernel, which is one workgroup.
const uint PREFIX_LANES = 256u;

// Memory instructions as the virtual L1 tells them apart: loads from global memory.
const uint ACCESS_LOAD = 0u;
// Stores to global memory.
const uint ACCESS_STORE = 1u;
// Loads from local memory, the stack.
const uint ACCESS_POP = 2u;
// Stores to local memory.
const uint ACCESS_PUSH = 3u;
// Number of kinds.
const uint ACCESS_KINDS = 4u;
// Most lines of the virtual L1: 64 KiB of 128-byte lines, more than Fermi's 48.
const uint VIRTUAL_LINES = 512u;
// Most warps that a virtual SM holds; Fermi's holds 48.
const uint VIRTUAL_WARPS = 64u;
// Turns of a virtual SM in a dispatch. A turn takes at most 3 x 8 + 1 instructions of 32 lines, and a loop one
// iteration more than that each: 64 turns stay below 65,535 iterations, the strictest limit known of any driver.
const uint VIRTUAL_TURNS = 64u;

// Primitive id of a miss.
const uint NO_HIT = 0xFFFFFFFFu;

// Lanes of a warp, in launch order and whatever the driver's subgroup is; also the workgroup size.
const uint WARP = 32u;
// A warp covers this many pixels across (Aila and Laine 2009 use the same 8x4 tiles).
const uint TILE_WIDTH = 8u;
// A warp covers this many pixels down.
const uint TILE_HEIGHT = 4u;

// Of a buffer that is read as texels: four 32-bit integers.
const uint TEXEL_BYTES = 16u;

// Direction components below this magnitude (2^-80) are replaced by it in box tests, so that no
// reciprocal is infinite and no product is 0 x infinity (Aila and Laine 2009 do the same).
const float DIRECTION_FLOOR = 8.271806125530277e-25;
// Slack of box planes relative to the farthest corner of the scene: bounds the rounding of the sheared
// coordinates of the triangle test, 7 x 2^-24 by counting its operations, doubled (Woop, Benthin and
// Wald 2013, section 3.3, argue the same way). 2^-20.
const float BOX_SLACK = 9.5367431640625e-7;
// Slack of box planes relative to the origin's own magnitude, so that adding any slack moves it by at
// least one step. 2^-23.
const float ORIGIN_SLACK = 1.1920928955078125e-7;
// A box's far distance is scaled by 1 + 2 gamma(3) (Ize 2013, section 4).
const float FAR_PADDING = 1.0000004;
// Drivers keep denormal numbers (below 2^-126) or make them zero; the floors from here to PRODUCT_FLOOR see to
// it that no hit tells which.
//
// Coordinates and distances below this magnitude (2^-40) count as zero. Coordinates left, and their differences,
// are multiples of 2^-63. The loader applies it to vertices, the ray generators to origins.
const float COORDINATE_FLOOR = 9.094947017729282e-13;
// Components of a ray's shear below this magnitude (2^-40) count as zero, for all triangles alike. With p and z
// multiples of 2^-63, p - shear * z is then zero or at least 2^-103: a normal number.
const float SHEAR_FLOOR = 9.094947017729282e-13;
// Edge functions above this magnitude (2^-100) do not depend on denormal products: next to a product as large
// as the difference, such a one is below half a step. Barycentric weights below it count as zero.
const float EDGE_FLOOR = 7.888609052210118e-31;
// Edge functions up to EDGE_FLOOR count as zero, the ray meets the edge, if their products are below this
// magnitude (2^-75). If not, then the products are equal, and their rounding errors decide, which are multiples
// of 2^-122. Only triangles which from the ray's origin measure less than 2^-72 can be lost by that.
const float PRODUCT_FLOOR = 2.6469779601696886e-23;
// A distance is interpolated by barycentric weights if the largest sheared coordinates x and y, multiplied, over the
// determinant, times the range of the corners' depths over the depth, is at most this. Weights are off by at most some
// four roundings of the first quotient, so that distances are by 16 x 4 x 2^-24, 4e-6. The test of Woop, Benthin and
// Wald always interpolates, and is off by percents where rays graze large triangles from nearby.
const float DEPTH_CONDITION = 16.0;
// Components of a triangle's normal, edges scaled to 1, below this magnitude (2^-40) count as zero: a ray's slope
// against the plane is then zero or at least 2^-103.
const float NORMAL_FLOOR = 9.094947017729282e-13;
// Coordinates of a point of the plane, relative to the ray's origin, below this magnitude (2^-60) count as zero:
// times components of the normal they are multiples of 2^-123.
const float POINT_FLOOR = 8.673617379884035e-19;
// Vectors of which no component reaches this magnitude (2^-100) have no direction.
const float VECTOR_FLOOR = 7.888609052210118e-31;
// Smallest argument of exact_sqrt but 0 (2^-78): the residual of its root is then a multiple of 2^-126, not a
// denormal number. Squared distances below it count as zero.
const float SQRT_FLOOR = 3.308722450212111e-24;
// Rays leave a surface this far along its normal, relative to the largest coordinate of the triangle:
// 16 rounding errors of the interpolated point and of the next intersection. 2^-19.
const float SURFACE_OFFSET = 1.9073486328125e-6;

// Largest distance of an unlimited ray.
const float FAR_AWAY = 3.0e38;

// Ray kinds, index of per-kind ray counts.
const uint KIND_PRIMARY = 0u;
// Shadow ray towards a light.
const uint KIND_SHADOW = 1u;
// Ambient occlusion ray of limited length.
const uint KIND_AO = 2u;
// Diffuse bounce, cosine-weighted.
const uint KIND_DIFFUSE = 3u;
// Mirror reflection.
const uint KIND_REFLECT = 4u;
// Refraction into or out of a transmissive surface.
const uint KIND_REFRACT = 5u;
// Number of ray kinds.
const uint KINDS = 6u;

// Material flags: shows its base colour as it is (KHR_materials_unlit).
const uint MATERIAL_UNLIT = 1u;
// Transmission through a solid (KHR_materials_volume): rays bend. Without it, walls are infinitely thin.
const uint MATERIAL_SOLID = 2u;
// Texture index of a material without one.
const uint NO_TEXTURE = 0xFFFFFFFFu;

// Texture wrap modes.
const uint WRAP_REPEAT = 0u;
// Mirrored repeat.
const uint WRAP_MIRROR = 1u;
// Clamp to edge.
const uint WRAP_CLAMP = 2u;

// Light kinds.
const uint LIGHT_DIRECTIONAL = 0u;
// Point light.
const uint LIGHT_POINT = 1u;
// Spot light.
const uint LIGHT_SPOT = 2u;
// Not a light of the scene: the ambient term, shadowed by an ambient occlusion ray.
const uint LIGHT_AMBIENT = 0xFFFFFFFFu;

// What a diffuse surface asks of its surroundings besides lights: nothing.
const uint INDIRECT_NONE = 0u;
// One ambient occlusion ray.
const uint INDIRECT_AO = 1u;
// One diffuse bounce.
const uint INDIRECT_DIFFUSE = 2u;

// Path state: number of bounces in the low bits.
const uint PATH_DEPTH_MASK = 255u;
// The path has made its diffuse bounce.
const uint PATH_BOUNCED = 256u;
// The path's camera ray hit the scene: it counts for alpha.
const uint PATH_COVERED = 512u;

// Random dimensions used by a bounce; dimension = bounce * this + a number below it.
const uint DIMENSIONS = 8u;
// Dimension pair of the pixel jitter, and of a bounce's diffuse direction.
const uint DIMENSION_DIRECTION = 0u;
// Dimension of the choice between metal and dielectric.
const uint DIMENSION_METAL = 2u;
// Dimension of the choice between transmission and diffuse.
const uint DIMENSION_TRANSMISSION = 3u;
// Dimension of the choice between reflection and refraction.
const uint DIMENSION_FRESNEL = 4u;
// Dimension pair of the roughness of a reflection or refraction.
const uint DIMENSION_ROUGHNESS = 5u;
// Dimension of the camera jitter: past those of any bounce.
const uint DIMENSION_CAMERA = 4096u;
// Dimension pair of a bounce's ambient occlusion ray: offset from the bounce's own.
const uint DIMENSION_AO = 2048u;

// Luminance of linear RGB by Rec. 709: the share of red.
const float LUMINANCE_RED = 0.2126;
// The share of green.
const float LUMINANCE_GREEN = 0.7152;
// The share of blue.
const float LUMINANCE_BLUE = 0.0722;

// Depth of pixels that see nothing: far beyond any scene, yet finite, for programs that average.
const float Z_NOTHING = 1.0e10;

// Operations of verify_exact.comp: reciprocals of consecutive numbers.
const uint VERIFY_RCP = 0u;
// Square roots of consecutive numbers.
const uint VERIFY_SQRT = 1u;
// Rounding errors of products.
const uint VERIFY_PRODUCT_ERROR = 2u;

// Specialization constants. The driver rounds reciprocals correctly.
const uint SPEC_RCP_EXACT = 1u;
// The driver rounds square roots correctly.
const uint SPEC_SQRT_EXACT = 2u;
// The driver's fma rounds once.
const uint SPEC_FMA_FUSED = 3u;
// Steps after which an invocation of a trace kernel stops, 0 for no limit.
const uint SPEC_STEP_LIMIT = 4u;
// Count node visits and triangle tests.
const uint SPEC_COUNT = 5u;
// Some mesh has normals.
const uint SPEC_NORMALS = 6u;
// Some material has a texture.
const uint SPEC_TEXTURES = 7u;
// Some material is metallic.
const uint SPEC_MIRRORS = 8u;
// Some material transmits.
const uint SPEC_GLASS = 9u;
// Some material emits.
const uint SPEC_EMISSION = 10u;
// Some material is unlit.
const uint SPEC_UNLIT = 11u;
// INDIRECT_NONE, INDIRECT_AO or INDIRECT_DIFFUSE.
const uint SPEC_INDIRECT = 12u;
// Queries are for any hit, not for the nearest.
const uint SPEC_ANY_HIT = 13u;
// Record step traces.
const uint SPEC_RECORD = 14u;
// Invocations a workgroup of the migration kernel.
const uint SPEC_WORKGROUP = 15u;
// Rays that follow each other go much the same way.
const uint SPEC_COHERENT = 16u;
// Fewest entries that an invocation of the queue kernels goes through.
const uint SPEC_LEAST_STRIP = 17u;
#endif
