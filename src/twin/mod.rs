//! CPU twins of the kernels, file for file, on the same structs: what `glsl/include/NAME.glsl` and
//! `glsl/NAME.comp` do, bit for bit. Never imports `vulkan`.

pub mod box_test;
pub mod exact;
pub mod trace;
pub mod traverse;
pub mod triangle;
pub mod vec;
