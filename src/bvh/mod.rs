//! Bounding volume hierarchy: build, GPU layout, statistics.

pub mod build;
pub mod layout;
pub mod statistics;

pub use build::{Bvh, Quality};
