//! Warps: their basic blocks in order, with the lanes that run each and the cache lines that each of their memory
//! instructions touches.
//!
//! Lanes that part reconverge where the loops end (immediate post-dominators), so the order of blocks and all
//! accesses follow from the step traces alone; time does not enter.

mod batch;
mod layout;
mod queue;
mod traversal;
mod visits;
mod walk;
mod warp;

#[cfg(test)]
mod tests;

pub use batch::{Access, Batch, MemoryOp, Segment};
pub use layout::Layout;
pub use warp::Warp;

/// Lanes of a warp.
pub const LANES: usize = crate::shared::WARP as usize;
