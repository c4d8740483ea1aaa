//! Occupancy against registers, threads and shared memory, each with the other two as given.

use std::ops::RangeInclusive;

use plotters::prelude::*;

use crate::fermi::machine::Machine;
use crate::fermi::occupancy::{Demand, occupancy};
use crate::{Error, Result};

/// Pixels of a chart.
const SIZE: (u32, u32) = (1200, 400);

/// The three charts side by side, as SVG; the given demand is marked on each.
///
/// # Errors
/// [`Error::Check`] if the chart cannot be drawn.
pub fn chart(machine: &Machine, demand: Demand) -> Result<String> {
    let mut svg = String::new();
    draw(&mut svg, machine, demand).map_err(|error| Error::Check(format!("occupancy chart: {error}")))?;
    Ok(svg)
}

fn draw(svg: &mut String, machine: &Machine, demand: Demand) -> std::result::Result<(), Box<dyn std::error::Error>> {
    let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let shared = machine.sm.shared_kib * 1024;
    type Change = fn(Demand, u32) -> Demand;
    let axes: [(&str, RangeInclusive<u32>, usize, u32, Change); 3] = [
        ("registers a thread", 1..=63, 1, demand.registers, |d, registers| Demand { registers, ..d }),
        ("threads a block", 32..=1024, 32, demand.threads, |d, threads| Demand { threads, ..d }),
        ("bytes of shared memory a block", 0..=shared, 128, demand.shared, |d, shared| Demand { shared, ..d }),
    ];
    for (area, (label, range, step, given, change)) in root.split_evenly((1, 3)).iter().zip(axes) {
        let warps = |value: u32| occupancy(&machine.sm, change(demand, value)).warps;
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .x_label_area_size(36)
            .y_label_area_size(36)
            .build_cartesian_2d(*range.start()..*range.end(), 0..machine.sm.warps)?;
        chart.configure_mesh().x_desc(label).y_desc("warps").x_labels(6).light_line_style(TRANSPARENT).draw()?;
        chart.draw_series(LineSeries::new(range.step_by(step).map(|value| (value, warps(value))), &BLUE))?;
        chart.draw_series([Circle::new((given, warps(given)), 4, RED.filled())])?;
    }
    root.present()?;
    Ok(())
}
