//! What a model says, in one form for all fidelities.

use serde::Serialize;

use super::occupancy::Occupancy;

/// Accesses of a cache, one a line of a warp's memory instruction. Refused accesses are repeated and not counted
/// among them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// All that were served.
    pub accesses: u64,
    /// Those that sent for their line, or wrote past the cache.
    pub misses: u64,
    /// Those that found their line on its way.
    pub pending_hits: u64,
    /// Attempts refused for want of a line or an MSHR.
    pub refused: u64,
}

impl Counts {
    /// Adds those of another cache.
    pub fn add(&mut self, other: Counts) {
        self.accesses += other.accesses;
        self.misses += other.misses;
        self.pending_hits += other.pending_hits;
        self.refused += other.refused;
    }

    /// Misses an access, in GPGPU-Sim's convention: hits on a line under way are no misses.
    pub fn miss_rate(&self) -> f64 {
        self.misses as f64 / self.accesses.max(1) as f64
    }
}

/// A cache in a result.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CacheResult {
    /// Accesses, misses, pending hits.
    #[serde(flatten)]
    pub counts: Counts,
    /// Misses an access.
    pub miss_rate: f64,
    /// Misses a node or leaf visit of a warp.
    pub miss_rate_per_visit: f64,
}

impl CacheResult {
    /// `visits`: node and leaf visits of warps.
    pub fn new(counts: Counts, visits: u64) -> CacheResult {
        let miss_rate_per_visit = counts.misses as f64 / visits.max(1) as f64;
        CacheResult { counts, miss_rate: counts.miss_rate(), miss_rate_per_visit }
    }
}

/// Latencies in core cycles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Latency {
    /// From an L1 miss to its line, mean.
    pub memory: f64,
    /// Of a load, hits included: equation (1) of Zhu and Deng 2013.
    pub mean: f64,
}

/// Where the cycles went, a mean over multiprocessors; the parts add up to the total (Huang et al. 2022, GCoM).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct CpiStack {
    /// Issue, as if all lanes of each warp were active.
    pub base: f64,
    /// Issue for lanes that were not.
    pub divergence: f64,
    /// Waiting for results of arithmetic and for instructions.
    pub compute_data: f64,
    /// Waiting for arithmetic units.
    pub compute_structural: f64,
    /// Waiting for loads.
    pub memory_data: f64,
    /// Waiting for room in the load pipeline.
    pub memory_structural: f64,
    /// Nothing to do, because there were no more blocks.
    pub idle: f64,
}

impl CpiStack {
    /// Sum of the parts.
    pub fn total(&self) -> f64 {
        self.base
            + self.divergence
            + self.compute_data
            + self.compute_structural
            + self.memory_data
            + self.memory_structural
            + self.idle
    }

    /// Adds `share` of another stack.
    pub fn add_scaled(&mut self, other: &CpiStack, share: f64) {
        self.base += other.base * share;
        self.divergence += other.divergence * share;
        self.compute_data += other.compute_data * share;
        self.compute_structural += other.compute_structural * share;
        self.memory_data += other.memory_data * share;
        self.memory_structural += other.memory_structural * share;
        self.idle += other.idle * share;
    }

    /// Names and cycles of the parts.
    pub fn parts(&self) -> [(&'static str, f64); 7] {
        [
            ("base", self.base),
            ("divergence", self.divergence),
            ("compute data", self.compute_data),
            ("compute structural", self.compute_structural),
            ("memory data", self.memory_data),
            ("memory structural", self.memory_structural),
            ("idle", self.idle),
        ]
    }
}

/// Instructions issued.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Instructions {
    /// By warps.
    pub warp: u64,
    /// By lanes.
    pub thread: u64,
}

/// How exactly time was modelled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Fidelity {
    /// Closed form from totals.
    Counters,
    /// Caches replayed, time by closed form.
    Caches,
    /// Everything replayed.
    Cycles,
}

/// What is charged to a strategy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Accounting {
    /// Everything.
    Full,
}

/// Prediction for one launch.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Prediction {
    /// Core cycles.
    pub cycles: u64,
    /// Million rays a second at the machine's clock.
    pub mrays_per_s: f64,
    /// Rays traced.
    pub rays: u64,
    /// Active lanes of issued warp instructions over 32.
    pub simd_efficiency: f64,
    /// Instructions issued.
    pub instructions: Instructions,
    /// First-level caches together.
    pub l1: CacheResult,
    /// Second-level cache.
    pub l2: CacheResult,
    /// Mean latencies.
    pub latency: Latency,
    /// Occupancy.
    pub occupancy: Occupancy,
    /// Where the cycles went.
    pub cpi: CpiStack,
    /// Name of the machine.
    pub machine: String,
    /// Name of the kernel.
    pub kernel: String,
    /// How time was modelled.
    pub fidelity: Fidelity,
    /// What was charged.
    pub accounting: Accounting,
    /// Modelled seconds: cycles at the machine's clock.
    pub seconds: f64,
}
