// Reciprocal and square root rounded correctly on every driver, and the rounding error of a product.
//
// Vulkan lets a driver be 2.5 ULP off in division and more in sqrt. Where the start-up probe found the
// driver exact its own result is used; elsewhere it is corrected by fused multiply-adds, which all such
// drivers have in hardware. `caribou verify` proves both exhaustively over all mantissas.
#ifndef EXACT_GLSL
#define EXACT_GLSL
#include "shared.glsl"

layout(constant_id = SPEC_RCP_EXACT) const bool DRIVER_RCP_EXACT = false;
layout(constant_id = SPEC_SQRT_EXACT) const bool DRIVER_SQRT_EXACT = false;
layout(constant_id = SPEC_FMA_FUSED) const bool DRIVER_FMA_FUSED = true;

// 1 / x for normal x with a normal reciprocal. Two Newton steps are correctly rounded for every
// mantissa but the largest (Markstein 2000, theorem 8.3), whose reciprocal is put in by hand.
float exact_rcp(float x) {
    float y = 1.0 / x;
    if (DRIVER_RCP_EXACT) return y;
    y = fma(fma(-x, y, 1.0), y, y);
    y = fma(fma(-x, y, 1.0), y, y);
    uint bits = floatBitsToUint(x);
    uint last = (bits & 0x80000000u) | ((253u - ((bits >> 23) & 255u)) << 23) | 1u;
    return (bits & 0x7FFFFFu) == 0x7FFFFFu ? uintBitsToFloat(last) : y;
}

vec3 exact_rcp3(vec3 v) { return vec3(exact_rcp(v.x), exact_rcp(v.y), exact_rcp(v.z)); }

// sqrt(x) for x = 0 or x from SQRT_FLOOR up: one Newton step, then Tuckerman's test of both neighbours.
float exact_sqrt(float x) {
    float s = sqrt(x);
    if (DRIVER_SQRT_EXACT || x == 0.0) return s;
    s = fma(fma(-s, s, x), 0.5 / s, s);
    float below = uintBitsToFloat(floatBitsToUint(s) - 1u);
    float above = uintBitsToFloat(floatBitsToUint(s) + 1u);
    if (fma(-below, s, x) <= 0.0) return below;
    return fma(-s, above, x) > 0.0 ? above : s;
}

// a * b - p for p = the rounded a * b, exactly (Dekker 1971 where fma is not fused).
float product_error(float a, float b, float p) {
    if (DRIVER_FMA_FUSED) return fma(a, b, -p);
    float a_scaled = a * 4097.0, b_scaled = b * 4097.0;
    float a_high = a_scaled - (a_scaled - a), b_high = b_scaled - (b_scaled - b);
    float a_low = a - a_high, b_low = b - b_high;
    return ((a_high * b_high - p) + a_high * b_low + a_low * b_high) + a_low * b_low;
}
#endif
