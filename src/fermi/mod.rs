//! The Fermi model: step traces in, cycles of a described machine out. Pure: no GPU, no files.

pub mod addresses;
pub mod blocks;
pub mod cache;
pub mod caches;
pub mod contention;
pub mod counters;
pub mod cut;
pub mod cycles;
pub mod kernel;
pub mod launch;
pub mod lockstep;
pub mod machine;
pub mod needs;
pub mod occupancy;
pub mod plan;
pub mod profile;
pub mod result;
pub mod sampled;
pub mod settings;
pub mod simt;
pub mod sort;
pub mod times;

#[cfg(test)]
mod tests;

use launch::Launch;
use machine::Machine;
use result::{Accounting, Fidelity, Prediction};

use crate::{Error, Result};

/// Predicts what `machine` does with `launches`, which follow each other.
///
/// # Errors
/// [`crate::Error::Usage`] if a kernel does not fit the machine.
pub fn predict(
    machine: &Machine,
    launches: &[Launch],
    fidelity: Fidelity,
    accounting: Accounting,
) -> Result<Prediction> {
    let parts = match fidelity {
        Fidelity::Cycles => cycles::replay(machine, launches)?,
        Fidelity::Caches => caches::replay(machine, launches)?,
        Fidelity::Counters => counters::predict(machine, launches)?,
        // A sample is worth it where rays are not recorded yet: see `sampled::predict`.
        Fidelity::Sampled => {
            return Err(Error::usage("--fidelity sampled", "it samples the rays of a scene under strategy direct"));
        }
    };
    Ok(Prediction::of(machine, launches, &parts, (fidelity, accounting)))
}
