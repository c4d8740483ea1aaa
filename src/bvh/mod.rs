//! Bounding volume hierarchy: build, GPU layout, statistics.

pub mod build;
mod coincident;
mod lay_out;
pub mod partition;
mod pieces;
pub mod quantise;
pub mod statistics;
mod ties;
mod validate;

#[cfg(test)]
mod tests;

pub use build::{Bvh, Quality};
pub use partition::{Owners, Partition, Policy};
pub use quantise::QuantisedBvh;
