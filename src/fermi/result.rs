//! What a model says, in one form for all fidelities.

use serde::Serialize;

use super::launch::{Launch, Stage};
use super::machine::Machine;
use super::occupancy::{Limiter, Occupancy};
use super::sampled::Effort;
use super::simt::LANES;

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

    /// `count` times as many, rounded.
    pub(super) fn times(&self, count: f64) -> Counts {
        let times = |n: u64| (n as f64 * count).round() as u64;
        Counts {
            accesses: times(self.accesses),
            misses: times(self.misses),
            pending_hits: times(self.pending_hits),
            refused: times(self.refused),
        }
    }

    /// Those since it had counted `before`.
    pub fn since(&self, before: Counts) -> Counts {
        Counts {
            accesses: self.accesses - before.accesses,
            misses: self.misses - before.misses,
            pending_hits: self.pending_hits - before.pending_hits,
            refused: self.refused - before.refused,
        }
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
    /// Where the miss rate of a sample's population is with 95 % confidence.
    pub interval: Option<[f64; 2]>,
    /// Misses a node or leaf visit of a warp.
    pub miss_rate_per_visit: f64,
}

impl CacheResult {
    /// `visits`: node and leaf visits of warps.
    pub fn new(counts: Counts, visits: u64) -> CacheResult {
        let miss_rate_per_visit = counts.misses as f64 / visits.max(1) as f64;
        CacheResult { counts, miss_rate: counts.miss_rate(), interval: None, miss_rate_per_visit }
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
    /// Making queues.
    pub queue: f64,
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
            + self.queue
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
        self.queue += other.queue * share;
        self.idle += other.idle * share;
    }

    /// Names and cycles of the parts.
    pub fn parts(&self) -> [(&'static str, f64); 8] {
        [
            ("base", self.base),
            ("divergence", self.divergence),
            ("compute data", self.compute_data),
            ("compute structural", self.compute_structural),
            ("memory data", self.memory_data),
            ("memory structural", self.memory_structural),
            ("queue", self.queue),
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

impl Instructions {
    /// Counts `warp` instructions of a warp, run by `lanes` of its lanes.
    pub(super) fn issue(&mut self, warp: u64, lanes: u8) {
        self.warp += warp;
        self.thread += warp * u64::from(lanes);
    }

    /// Adds others.
    pub(super) fn add(&mut self, other: &Instructions) {
        self.warp += other.warp;
        self.thread += other.thread;
    }

    /// Active lanes of issued warp instructions over 32.
    pub fn efficiency(&self) -> f64 {
        self.thread as f64 / (self.warp.max(1) * LANES as u64) as f64
    }
}

/// How exactly time was modelled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Fidelity {
    /// Closed form from totals.
    Counters,
    /// Caches replayed for a sample of warps, with an interval.
    Sampled,
    /// Caches replayed, time by closed form.
    Caches,
    /// Everything replayed.
    Cycles,
}

/// What is charged to strategy `migrate`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Accounting {
    /// A virtual L1 a subtree, and queues and scheduling for nothing (Zhu and Deng 2013, section IV.B).
    Paper,
    /// Everything, with one real L1 a multiprocessor.
    #[default]
    Full,
}

/// What one launch costs.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Stage that it is part of.
    pub stage: Stage,
    /// Core cycles.
    pub cycles: f64,
    /// Instructions issued.
    pub instructions: Instructions,
    /// Node and leaf visits of warps.
    pub visits: u64,
    /// First-level caches together.
    pub l1: Counts,
    /// Second-level cache.
    pub l2: Counts,
    /// Mean latencies.
    pub latency: Latency,
    /// Occupancy.
    pub occupancy: Occupancy,
    /// Where the cycles went.
    pub cpi: CpiStack,
}

/// Cycles of a stage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StageCycles {
    /// The stage.
    pub stage: Stage,
    /// Launches.
    pub launches: usize,
    /// Core cycles.
    pub cycles: u64,
}

/// Prediction for one launch.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Prediction {
    /// Core cycles.
    pub cycles: u64,
    /// Where the cycles of a sample's population are with 95 % confidence.
    pub interval: Option<[f64; 2]>,
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
    /// Occupancy of the traversal.
    pub occupancy: Occupancy,
    /// Where the cycles went.
    pub cpi: CpiStack,
    /// Cycles of each stage.
    pub stages: Vec<StageCycles>,
    /// Name of the machine.
    pub machine: String,
    /// Name of the kernel of the traversal.
    pub kernel: String,
    /// How time was modelled.
    pub fidelity: Fidelity,
    /// What was charged.
    pub accounting: Accounting,
    /// Modelled seconds: cycles at the machine's clock.
    pub seconds: f64,
    /// What a sample cost and left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<Effort>,
}

impl Prediction {
    /// Of launches that follow each other, with what each costs.
    pub fn of(
        machine: &Machine,
        launches: &[Launch],
        parts: &[Part],
        (fidelity, accounting): (Fidelity, Accounting),
    ) -> Prediction {
        let (mut l1, mut l2) = (Counts::default(), Counts::default());
        let (mut instructions, mut cpi) = (Instructions::default(), CpiStack::default());
        let (mut cycles, mut visits, mut latency) = (0.0, 0, Latency::default());
        let mut stages: Vec<StageCycles> = Vec::new();
        for part in parts {
            cycles += part.cycles;
            visits += part.visits;
            instructions.add(&part.instructions);
            latency.memory += part.latency.memory * part.l1.misses as f64;
            latency.mean += part.latency.mean * part.l1.accesses as f64;
            l1.add(part.l1);
            l2.add(part.l2);
            match part.stage {
                Stage::Queue => cpi.queue += part.cycles,
                Stage::Schedule | Stage::Traverse => cpi.add_scaled(&part.cpi, 1.0),
            }
            match stages.iter_mut().find(|known| known.stage == part.stage) {
                Some(known) => {
                    known.launches += 1;
                    known.cycles += part.cycles as u64;
                }
                None => stages.push(StageCycles { stage: part.stage, launches: 1, cycles: part.cycles as u64 }),
            }
        }
        latency.memory /= l1.misses.max(1) as f64;
        latency.mean /= l1.accesses.max(1) as f64;
        let main = launches.iter().zip(parts).rfind(|(launch, _)| launch.stage == Stage::Traverse);
        let rays = launches.first().map_or(0, |launch| launch.rays()) as u64;
        let seconds = cycles / (machine.clock_mhz * 1e6);
        Prediction {
            cycles: cycles as u64,
            interval: None,
            mrays_per_s: if cycles > 0.0 { rays as f64 / seconds / 1e6 } else { 0.0 },
            rays,
            simd_efficiency: instructions.efficiency(),
            instructions,
            l1: CacheResult::new(l1, visits),
            l2: CacheResult::new(l2, visits),
            latency,
            occupancy: main.map_or(NO_TRAVERSAL, |(_, part)| part.occupancy),
            cpi,
            stages,
            machine: machine.name.clone(),
            kernel: main.map_or(String::new(), |(launch, _)| launch.kernel.name.clone()),
            fidelity,
            accounting,
            seconds,
            tolerance: None,
        }
    }

    /// That of a sample, with intervals of cycles and of the miss rates of both caches.
    pub fn sampled(mut self, [cycles, l1, l2]: [[f64; 2]; 3], effort: Effort) -> Prediction {
        (self.interval, self.l1.interval, self.l2.interval) = (Some(cycles), Some(l1), Some(l2));
        self.tolerance = Some(effort);
        self
    }
}

/// Occupancy where no ray reaches a subtree.
const NO_TRAVERSAL: Occupancy = Occupancy { blocks: 0, warps: 0, limiter: Limiter::Warps };
