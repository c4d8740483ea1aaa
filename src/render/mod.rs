//! Integrator, film and AOVs; EXR and PNG out.

pub mod aov;
pub mod camera_matrices;
pub mod compare;
pub mod cpu;
pub mod exr;
pub mod false_color;
pub mod features;
pub mod film;
pub mod gpu;
mod gpu_scene;
pub mod image;
pub mod integrator;
pub mod noise;
pub mod picture;
pub mod png;
pub mod rays;
pub mod settings;
pub mod stages;
pub mod tone;
