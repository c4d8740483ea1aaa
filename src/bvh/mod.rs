//! Bounding volume hierarchy: build, GPU layout, statistics.

pub mod build;
pub mod statistics;

pub use build::{Bvh, Quality};
