//! Rays in, hits and counters out.

pub mod accounting;
pub mod digest;
pub mod exchange;
pub mod geometry;
mod migrator;
pub mod options;
mod queues;
pub mod speculative;
pub mod step_sample;
pub mod steps;
pub mod stream;
pub mod tracer;
pub mod twin_tracer;
pub mod verify;
pub mod virtual_l1;
mod whole_tree;

pub use crate::layout::{Hit, Ray, RayCounters};
pub use accounting::{MigrationReport, Totals};
pub use geometry::Geometry;
pub use migrator::QUOTA;
pub use options::{MachineOptions, NodeFormat, Query, Strategy, TracerOptions};
pub(crate) use queues::Digits;
pub use step_sample::StepSample;
pub use steps::StepTrace;
pub use stream::Stream;
pub use tracer::{RayBuffers, RayFeatures, StepBuffers, Tracer};
pub use twin_tracer::TwinTracer;
pub use verify::{Verdict, verify_arithmetic};
