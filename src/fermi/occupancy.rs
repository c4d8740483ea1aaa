//! How many blocks a multiprocessor holds, and what limits them.

use serde::Serialize;

use super::launch::Launch;
use super::machine::{Machine, Rule, Sm};
use super::simt::LANES;
use crate::{Error, Result};

/// Unit in which shared memory is given out, bytes (`cuda_occupancy.h`, compute capability 2.x).
const SHARED_UNIT: u32 = 128;
/// Unit in which a warp's registers are given out (the same).
const REGISTER_UNIT: u32 = 64;
/// Register counts a thread for which the unit is twice that (the same).
const DOUBLE_UNIT: [u32; 8] = [21, 22, 29, 30, 37, 38, 45, 46];
/// Registers and shared memory come in this many parts with one warp scheduler each (the same).
const PARTITIONS: u32 = 2;
/// Most threads a block may have (the same).
const MAX_THREADS: u32 = 1024;
/// Most registers a thread may have (the same).
const MAX_REGISTERS: u32 = 63;
/// GPGPU-Sim rounds a thread's registers up to a multiple of this.
const GPGPUSIM_REGISTER_UNIT: u32 = 4;

/// What a kernel asks of a multiprocessor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Demand {
    /// Registers a thread.
    pub registers: u32,
    /// Threads a block.
    pub threads: u32,
    /// Bytes of shared memory a block.
    pub shared: u32,
}

/// What keeps more blocks out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Limiter {
    /// The register file.
    Registers,
    /// Warps or threads.
    Warps,
    /// Blocks.
    Blocks,
    /// Shared memory.
    Shared,
}

/// Blocks and warps that a multiprocessor holds at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Occupancy {
    /// Blocks; 0 if the launch fails.
    pub blocks: u32,
    /// Warps.
    pub warps: u32,
    /// The tightest limit.
    pub limiter: Limiter,
}

/// Occupancy of `sm` by a kernel under its rule of allocation.
pub fn occupancy(sm: &Sm, demand: Demand) -> Occupancy {
    let warps = demand.threads.div_ceil(LANES as u32).max(1);
    let by_registers = match sm.rule {
        Rule::Cuda => blocks_by_registers(sm, demand.registers, warps),
        Rule::Gpgpusim => {
            let rounded = demand.registers.next_multiple_of(GPGPUSIM_REGISTER_UNIT);
            sm.registers.checked_div(rounded * demand.threads.next_multiple_of(LANES as u32)).unwrap_or(sm.blocks)
        }
    };
    let by_warps = match sm.rule {
        Rule::Cuda => (sm.warps / warps).min(sm.threads / demand.threads.max(1)),
        Rule::Gpgpusim => sm.threads / demand.threads.next_multiple_of(LANES as u32).max(1),
    };
    let shared = match sm.rule {
        Rule::Cuda => demand.shared.next_multiple_of(SHARED_UNIT),
        Rule::Gpgpusim => demand.shared,
    };
    let by_shared = (sm.shared_kib * 1024).checked_div(shared).unwrap_or(u32::MAX);
    let limits = [
        (by_registers, Limiter::Registers),
        (by_warps, Limiter::Warps),
        (sm.blocks, Limiter::Blocks),
        (by_shared, Limiter::Shared),
    ];
    let (mut blocks, limiter) = limits.into_iter().min_by_key(|&(blocks, _)| blocks).unwrap_or(limits[2]);
    if sm.rule == Rule::Cuda && (demand.threads > MAX_THREADS || demand.registers > MAX_REGISTERS) {
        blocks = 0;
    }
    Occupancy { blocks, warps: blocks * warps, limiter }
}

/// Occupancy of `machine` by the kernel of `launch`, which must fit it.
///
/// # Errors
/// [`Error::Usage`] if no block fits a multiprocessor.
pub fn launchable(machine: &Machine, launch: &Launch) -> Result<Occupancy> {
    let demand = launch.demand();
    let occupancy = occupancy(&machine.sm, demand);
    if occupancy.blocks == 0 {
        let Demand { registers, threads, shared } = demand;
        return Err(Error::usage(
            format!("{}: no block fits a multiprocessor of {}", launch.kernel.name, machine.name),
            format!("{threads} threads of {registers} registers with {shared} bytes are too many: ask for fewer"),
        ));
    }
    Ok(occupancy)
}

/// `cuda_occupancy.h`: registers are given out by warp, in a unit that depends on their number, from
/// partitions that no warp straddles; and a block must fit as if its warps were an even number.
fn blocks_by_registers(sm: &Sm, registers: u32, warps: u32) -> u32 {
    if registers == 0 {
        return sm.blocks;
    }
    let unit = if DOUBLE_UNIT.contains(&registers) { 2 * REGISTER_UNIT } else { REGISTER_UNIT };
    let a_warp = (registers * LANES as u32).next_multiple_of(unit);
    if a_warp * warps.next_multiple_of(PARTITIONS) > sm.registers {
        return 0;
    }
    PARTITIONS * (sm.registers / PARTITIONS / a_warp) / warps
}

#[cfg(test)]
#[path = "occupancy_tests.rs"]
mod tests;
