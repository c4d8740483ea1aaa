//! Bounding volume hierarchy: build, GPU layout, statistics.

pub mod layout;
