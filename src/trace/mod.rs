//! Rays in, hits and counters out.

pub mod digest;
pub mod exchange;
pub mod geometry;
pub mod steps;
pub mod stream;
pub mod tracer;
pub mod verify;

pub use crate::layout::{Hit, Ray, RayCounters};
pub use geometry::Geometry;
pub use steps::StepTrace;
pub use stream::Stream;
pub use tracer::{Query, Tracer, TracerOptions};
pub use verify::{Verdict, verify_arithmetic};
