//! The stages of a picture, as the device and the twin both provide them.

use std::collections::BTreeMap;

use super::film::Batch;
use crate::Result;
use crate::shared::KINDS;

/// Rays by kind, `KIND_*` in [`crate::shared`].
pub type RayCounts = [u64; KINDS as usize];

/// Names of the ray kinds, in the order of [`RayCounts`].
pub const KIND_NAMES: [&str; KINDS as usize] = ["primary", "shadow", "ao", "diffuse", "reflect", "refract"];

/// One stage a method, over the paths of a batch: those numbered `first..first + count` of the pixels of the chosen
/// tiles, one sample at a time. A stage may be put off until a result is asked for.
pub trait Stages {
    /// Most paths of a batch.
    fn capacity(&self) -> u32;
    /// Chooses the tiles whose pixels are sampled.
    fn choose(&mut self, tiles: &[u32]) -> Result<()>;
    /// Begins a batch.
    fn begin(&mut self, first: u32, count: u32);
    /// Camera rays of a sample.
    fn generate(&mut self, sample: u32) -> Result<()>;
    /// Nearest hits of the paths' rays; `coherent` if those that follow each other go much the same way.
    fn trace_closest(&mut self, coherent: bool) -> Result<()>;
    /// Keeps what the camera rays met.
    fn aov(&mut self) -> Result<()>;
    /// Adds a light, or ambient light (`LIGHT_AMBIENT`), shadowed by rays that are `coherent` or not.
    fn light(&mut self, light: u32, coherent: bool) -> Result<()>;
    /// Replaces the paths' rays by the next ones.
    fn shade(&mut self) -> Result<()>;
    /// Adds the sample to the sums of the batch, after `before` others.
    fn resolve(&mut self, before: u32) -> Result<()>;
    /// Rays made since the last call, but for camera rays.
    fn take_ray_counts(&mut self) -> Result<RayCounts>;
    /// The batch's sums and, with `aovs`, what [`Stages::aov`] kept.
    fn read(&mut self, aovs: bool) -> Result<Batch>;
    /// Seconds by stage so far.
    fn seconds(&self) -> BTreeMap<String, f64>;
}
