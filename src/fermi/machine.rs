//! Machines: every number of the hardware that time depends on, from TOML.

mod check;

use std::collections::HashMap;

use serde::Deserialize;

use super::cache::Cache;
use super::kernel::{Instruction, Operation};
use super::settings::{Source, Text};
use crate::{Error, Result};

/// Embedded descriptions, by name.
const MACHINES: &[(&str, &str)] = &[
    ("gtx480", include_str!("machines/gtx480.toml")),
    ("gtx560ti", include_str!("machines/gtx560ti.toml")),
    ("gpgpusim-3.2.2", include_str!("machines/gpgpusim-3.2.2.toml")),
    ("gpgpusim-4.2", include_str!("machines/gpgpusim-4.2.toml")),
    ("teslac2050", include_str!("machines/teslac2050.toml")),
];

/// Bytes of a cache line: the unit of coalescing on all machines described.
pub const LINE: u64 = 128;

/// A machine. Cycles are those of the core clock, at which one scheduler issues one warp.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Machine {
    /// Name of the description.
    pub name: String,
    /// Core clock.
    pub clock_mhz: f64,
    /// Streaming multiprocessors.
    pub sms: u32,
    /// One multiprocessor.
    pub sm: Sm,
    /// Latency, interval and unit of each operation.
    pub operations: HashMap<Operation, Timing>,
    /// Data cache of a multiprocessor.
    pub l1: L1,
    /// Its texture units and their cache.
    pub texture: Texture,
    /// Network between multiprocessors and memory.
    pub crossbar: Crossbar,
    /// Second-level cache.
    pub l2: L2,
    /// Memory.
    pub dram: Dram,
}

/// Limits and pipelines of a multiprocessor.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sm {
    /// Resident warps at most.
    pub warps: u32,
    /// Resident threads at most.
    pub threads: u32,
    /// Resident blocks at most.
    pub blocks: u32,
    /// Registers.
    pub registers: u32,
    /// Shared memory.
    pub shared_kib: u32,
    /// Rule of register allocation.
    pub rule: Rule,
    /// Warp schedulers; each issues one instruction a cycle.
    pub schedulers: u32,
    /// Arithmetic pipelines for common operations.
    pub sp_units: u32,
    /// Operands that the collector reads for an instruction in a cycle.
    pub operands: u64,
    /// Cycles from issue to the start of execution, and back to the registers, beside the latency itself and the
    /// reading of operands.
    pub pipeline: u64,
    /// Cycles from issue of a memory instruction to its first access of the L1, beside the reading of operands.
    /// A hit can be used at once.
    pub load_pipeline: u64,
    /// Memory instructions between issue and the L1.
    pub load_queue: usize,
    /// Whether a memory instruction takes an issue slot for each of its requests, not only for the first.
    pub replay: bool,
    /// Instructions fetched at a time.
    pub fetch: u32,
    /// Cycles from fetch to issue.
    pub fetch_latency: u64,
}

/// Rule of register allocation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rule {
    /// As NVIDIA's `cuda_occupancy.h` has it for compute capability 2.x.
    Cuda,
    /// As GPGPU-Sim has it.
    Gpgpusim,
}

/// How long an operation takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Timing {
    /// Cycles in the pipeline.
    pub latency: u64,
    /// Cycles until the unit takes the next.
    pub interval: u64,
    /// Where it runs.
    pub unit: Unit,
}

/// Execution units.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Unit {
    /// Common operations.
    Sp,
    /// Special functions and integer products.
    Sfu,
}

/// First-level cache.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct L1 {
    /// Capacity.
    pub kib: u64,
    /// Ways; an override of the capacity alone brings those that Fermi has with it.
    pub ways: u64,
    /// Bytes of a line.
    pub line: u64,
    /// From line address to set.
    pub mapping: Mapping,
    /// Lines under way at most.
    pub mshrs: usize,
    /// Accesses a line under way serves at most.
    pub merges: usize,
    /// Misses that wait for the network.
    pub miss_queue: usize,
    /// Bytes of the words that lanes side by side ask for in one request.
    pub request: u64,
}

/// Texture units of a multiprocessor and their cache, of lines like the L1's.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Texture {
    /// Capacity.
    pub kib: u64,
    /// Ways.
    pub ways: u64,
    /// Cycles from issue to the use of a hit, beside the reading of operands.
    pub latency: u64,
    /// Bytes a cycle.
    pub port: u64,
}

/// From line address to set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mapping {
    /// The low bits.
    Linear,
    /// The hash of the real GF100, found by Nugteren et al. 2014.
    Hashed,
}

/// Crossbar between multiprocessors and L2 slices, one each way.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Crossbar {
    /// Bytes a port passes in a cycle.
    pub flit: u64,
    /// Bytes of a packet besides its data.
    pub header: u64,
    /// Cycles from one end to the other without contention.
    pub latency: u64,
    /// Cycles a port out stays idle between packets, for the allocation of its channel.
    pub gap: u64,
    /// Packets that wait at a port.
    pub queue: usize,
}

/// Second-level cache, in slices.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct L2 {
    /// Slices.
    pub slices: u32,
    /// Capacity of a slice.
    pub slice_kib: u64,
    /// Ways.
    pub ways: u64,
    /// Bytes of a line.
    pub line: u64,
    /// Lines under way at most, a slice.
    pub mshrs: usize,
    /// Accesses a line under way serves at most.
    pub merges: usize,
    /// Misses that wait for memory.
    pub miss_queue: usize,
    /// Requests that wait at each door of a slice.
    pub queue: usize,
    /// Cycles before the lookup.
    pub latency: u64,
    /// Bytes its data port passes in a cycle.
    pub port: u64,
}

/// Memory: channels of banks with open rows. Times are in cycles of its own clock.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dram {
    /// Channels.
    pub channels: u32,
    /// Command clock.
    pub mhz: f64,
    /// Core cycles on the way to the scheduler.
    pub latency: u64,
    /// Bytes in a row between one channel and the next.
    pub interleave: u64,
    /// Requests the scheduler sees.
    pub queue: usize,
    /// Requests on the way to and from a channel.
    pub return_queue: usize,
    /// Banks of a channel.
    pub banks: u32,
    /// Groups of banks.
    pub groups: u32,
    /// Bytes of a row, in one channel.
    pub row: u64,
    /// Bytes of a burst.
    pub burst: u64,
    /// Column command to column command.
    pub ccd: u64,
    /// The same within a group of banks.
    pub ccdl: u64,
    /// Activation to activation of another bank.
    pub rrd: u64,
    /// Activation to column command.
    pub rcd: u64,
    /// Activation to precharge.
    pub ras: u64,
    /// Precharge to activation.
    pub rp: u64,
    /// Activation to activation of a bank.
    pub rc: u64,
    /// Column command to data, reading.
    pub cl: u64,
    /// Column command to data, writing.
    pub wl: u64,
    /// Last write data to read command.
    pub cdlr: u64,
    /// Last write data to precharge.
    pub wr: u64,
    /// Read to precharge within a group.
    pub rtpl: u64,
}

impl Machine {
    /// The embedded machine `name`, with `overrides` as `key=value`.
    ///
    /// # Errors
    /// [`Error::Usage`] for an unknown name, [`Error::Input`] for unknown keys and impossible values.
    pub fn named(name: &str, overrides: &[String]) -> Result<Machine> {
        Machine::parse(Source::embedded("machine", MACHINES, name)?, overrides)
    }

    /// Names of the embedded machines.
    pub fn known() -> impl Iterator<Item = &'static str> {
        MACHINES.iter().map(|&(name, _)| name)
    }

    /// Reads and checks a description.
    ///
    /// # Errors
    /// [`Error::Input`] naming key and file.
    pub fn parse(source: Source, overrides: &[String]) -> Result<Machine> {
        let mut machine: Machine = Text::new(&source, overrides)?.read()?;
        let overrides_key = |key: &str| overrides.iter().any(|setting| setting.starts_with(key));
        if overrides_key("l1.kib=") && !overrides_key("l1.ways=") {
            machine.l1.ways = L1::natural_ways(machine.l1.kib);
        }
        machine
            .check()
            .map_err(|(key, problem)| Error::input(source.file, key, problem, "give a value that hardware can have"))?;
        Ok(machine)
    }

    /// Cycles from issue of a load to the use of a hit, beside the reading of operands.
    pub fn load_latency(&self, operation: Operation) -> u64 {
        if operation == Operation::Texture { self.texture.latency } else { self.sm.load_pipeline }
    }

    /// Latency, interval and unit of `operation`; memory operations have none.
    pub fn timing(&self, operation: Operation) -> Option<Timing> {
        self.operations.get(&operation).copied()
    }
}

impl Texture {
    /// Its cache, empty.
    pub fn cache(&self) -> Cache {
        Cache::new(self.kib * 1024 / LINE / self.ways, self.ways, Mapping::Linear)
    }
}

impl Sm {
    /// Cycles for which the operand collector reads for `instruction`.
    pub fn collect(&self, instruction: &Instruction) -> u64 {
        instruction.operands().div_ceil(self.operands)
    }
}

impl L2 {
    /// Sets of a slice.
    pub fn sets(&self) -> u64 {
        self.slice_kib * 1024 / LINE / self.ways
    }

    /// Lines of all slices.
    pub fn lines(&self) -> u64 {
        self.sets() * self.ways * u64::from(self.slices)
    }
}

impl L1 {
    /// Ways that Fermi has at a capacity (fermi.md, Caches: 16 KB is 32 sets of 4, 48 KB is 64 sets of 6).
    fn natural_ways(kib: u64) -> u64 {
        if kib == 48 { 6 } else { 4 }
    }

    /// Sets.
    pub fn sets(&self) -> u64 {
        self.kib * 1024 / LINE / self.ways
    }
}
