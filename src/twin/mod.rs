//! CPU twins of the kernels, file for file, on the same structs: what `glsl/include/NAME.glsl` and
//! `glsl/NAME.comp` do, bit for bit. Never imports `vulkan`.

pub mod aov;
pub mod box_test;
pub mod exact;
pub mod gather;
pub mod generate;
pub mod light;
pub mod material;
pub mod migrate;
pub mod quantised;
pub mod random;
pub mod resolve;
pub mod sampling;
pub mod secondary;
pub mod shade;
pub mod sky;
pub mod surface;
pub mod texture;
pub mod tiles;
pub mod top_tree;
pub mod trace;
pub mod trail;
pub mod traverse;
pub mod triangle;
pub mod vec;
