//! Occupancy against registers, threads and shared memory, each with the other two as given.

use std::ops::RangeInclusive;

use super::chart::{Axis, Chart, Series, Style};
use crate::fermi::machine::Machine;
use crate::fermi::occupancy::{Demand, occupancy};

/// The three charts; the given demand is marked on each.
pub fn charts(machine: &Machine, demand: Demand) -> [Chart; 3] {
    type Change = fn(Demand, u32) -> Demand;
    let one = |label: &str, unit: &str, range: RangeInclusive<u32>, step: usize, given: u32, change: Change| {
        let at = |value: u32| (f64::from(value), f64::from(occupancy(&machine.sm, change(demand, value)).warps));
        Chart {
            title: format!("{}: occupancy against {label}", machine.name),
            x: Axis::linear(label, unit),
            y: Axis::linear("warps of a multiprocessor", ""),
            series: vec![
                Series::new("all others as given", Style::Line, range.step_by(step).map(at)),
                Series::new("given", Style::Points, [at(given)]),
            ],
            note: String::new(),
        }
    };
    let shared = machine.sm.shared_kib * 1024;
    [
        one("registers", "a thread", 1..=63, 1, demand.registers, |d, registers| Demand { registers, ..d }),
        one("threads", "a block", 32..=1024, 32, demand.threads, |d, threads| Demand { threads, ..d }),
        one("shared memory", "bytes a block", 0..=shared, 128, demand.shared, |d, shared| Demand { shared, ..d }),
    ]
}
