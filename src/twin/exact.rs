//! Twin of `exact.glsl`. Rust's division and square root are IEEE 754's, rounded correctly.

/// Correctly rounded reciprocal.
#[inline(always)]
pub fn exact_rcp(x: f32) -> f32 {
    1.0 / x
}

/// Correctly rounded square root.
#[inline(always)]
pub fn exact_sqrt(x: f32) -> f32 {
    x.sqrt()
}

/// `a * b - p` for `p` the rounded product, exactly: a product of two 24-bit numbers fits a double.
#[inline(always)]
pub fn product_error(a: f32, b: f32, p: f32) -> f32 {
    (f64::from(a) * f64::from(b) - f64::from(p)) as f32
}
