//! The Fermi model: step traces in, cycles of a described machine out. Pure: no GPU, no files.

pub mod addresses;
pub mod cache;
pub mod caches;
pub mod contention;
pub mod counters;
pub mod cycles;
pub mod kernel;
pub mod lockstep;
pub mod machine;
pub mod occupancy;
pub mod profile;
pub mod result;
pub mod settings;
pub mod simt;

#[cfg(test)]
mod tests;

use kernel::Kernel;
use machine::Machine;
use result::{Fidelity, Prediction};
use simt::Workload;

use crate::Result;

/// Predicts what `machine` does with `workload` run by `kernel`.
///
/// # Errors
/// [`crate::Error::Usage`] if the kernel does not fit the machine.
pub fn predict(machine: &Machine, kernel: &Kernel, workload: &Workload, fidelity: Fidelity) -> Result<Prediction> {
    match fidelity {
        Fidelity::Cycles => cycles::replay(machine, kernel, workload),
        Fidelity::Caches => caches::replay(machine, kernel, workload),
        Fidelity::Counters => counters::predict(machine, kernel, workload),
    }
}
