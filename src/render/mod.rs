//! Integrator, film and AOVs; EXR and PNG out.

pub mod aov;
pub mod camera_matrices;
pub mod exr;
pub mod false_color;
pub mod image;
pub mod png;
pub mod tone;
