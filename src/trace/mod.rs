//! Rays in, hits and counters out.

pub use crate::layout::{Hit, Ray, RayCounters};
