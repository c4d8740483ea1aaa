// Facts shared by host and kernels. build.rs turns every `const` line into a Rust constant of the
// same name in `caribou::shared`, so there is no second place to keep in step.

// Child link: a leaf has LEAF_BIT set, its triangle count in LEAF_COUNT_BITS from LEAF_COUNT_SHIFT, and
// its first triangle in the low bits; an inner child is the index of its node. An empty leaf has count 0.
const uint LEAF_BIT = 0x80000000u;
const uint LEAF_COUNT_SHIFT = 27u;
const uint LEAF_COUNT_MASK = 15u;
const uint LEAF_FIRST_MASK = 0x07FFFFFFu;

// Most triangles a leaf may hold.
const uint MAX_LEAF_TRIANGLES = 8u;

// Primitive id of a miss.
const uint NO_HIT = 0xFFFFFFFFu;

// Entries of the traversal stack; the builder refuses deeper trees.
const uint STACK_SIZE = 64u;
