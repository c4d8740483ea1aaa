// How the queue kernels divide a batch of entries among invocations.
#ifndef BATCH_GLSL
#define BATCH_GLSL

layout(constant_id = SPEC_LEAST_STRIP) const uint SHORTEST_STRIP = LEAST_STRIP;

Batch batch_of(uint count, uint sms) {
    uint strip = max((count + WARP * MOST_TILES - 1u) / (WARP * MOST_TILES), SHORTEST_STRIP);
    return Batch(count, strip, (count + WARP * strip - 1u) / (WARP * strip), 1u, 1u, count > 0u ? sms : 0u, 1u, 1u);
}
#endif
