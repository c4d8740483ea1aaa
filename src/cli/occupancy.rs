//! `caribou occupancy`: how many warps of a kernel a multiprocessor holds, and why no more.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::output;
use crate::atomic_file::check_writable;
use crate::fermi::machine::{Machine, Rule};
use crate::fermi::occupancy::{self, Demand};
use crate::report::chart::Format;
use crate::report::occupancy_chart::charts;
use crate::{Error, Result};

/// Show how many warps of a kernel a multiprocessor holds, and what limits them
#[derive(Args)]
pub struct Occupancy {
    /// Registers a thread
    #[arg(long, value_name = "R")]
    regs: u32,
    /// Threads a block
    #[arg(long, value_name = "T")]
    threads: u32,
    /// Bytes of shared memory a block
    #[arg(long, value_name = "S", default_value_t = 0)]
    shared: u32,
    /// gtx480, gtx560ti, gpgpusim-3.2.2, gpgpusim-4.2 or teslac2050
    #[arg(long, default_value = "gtx480")]
    machine: String,
    /// How registers are given out; by default the machine's own rule
    #[arg(long, value_enum)]
    rule: Option<Rule>,
    /// Change a number of the machine, e.g. sm.shared_kib=16
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
    /// Charts of occupancy against registers, threads and shared memory: .svg, .png, or the values as .csv
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Also write the result to a file, or to standard output with -
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

#[derive(Serialize)]
struct Report {
    machine: String,
    rule: Rule,
    registers: u32,
    threads: u32,
    shared: u32,
    #[serde(flatten)]
    occupancy: occupancy::Occupancy,
    occupancy_share: f64,
}

impl Occupancy {
    /// Computes and prints.
    pub fn run(&self) -> Result<()> {
        self.check()?;
        let mut machine = Machine::named(&self.machine, &self.settings)?;
        machine.sm.rule = self.rule.unwrap_or(machine.sm.rule);
        let demand = Demand { registers: self.regs, threads: self.threads, shared: self.shared };
        let occupancy = occupancy::occupancy(&machine.sm, demand);
        let report = Report {
            rule: machine.sm.rule,
            registers: self.regs,
            threads: self.threads,
            shared: self.shared,
            occupancy,
            occupancy_share: f64::from(occupancy.warps) / f64::from(machine.sm.warps),
            machine: machine.name.clone(),
        };
        if let Some(path) = &self.output {
            Format::of("-o", path)?.write(path, &charts(&machine, demand), 3)?;
        }
        if let Some(path) = &self.json {
            output::write_json(path, &report)?;
            if path.as_os_str() == "-" {
                return Ok(());
            }
        }
        output::print(&text(&report, machine.sm.warps))
    }

    fn check(&self) -> Result<()> {
        if !(1..=1024).contains(&self.threads) {
            return Err(Error::usage(format!("--threads {}", self.threads), "allowed are 1 to 1024"));
        }
        if self.regs > 255 {
            return Err(Error::usage(format!("--regs {}", self.regs), "allowed are 0 to 255"));
        }
        if let Some(path) = &self.output {
            Format::of("-o", path)?;
            check_writable(path)?;
        }
        self.json.iter().filter(|path| path.as_os_str() != "-").try_for_each(|path| check_writable(path))
    }
}

fn text(report: &Report, most: u32) -> String {
    let o = &report.occupancy;
    let limiter = format!("{:?}", o.limiter).to_lowercase();
    if o.blocks == 0 {
        return format!("{}: the launch fails, {limiter} allow no block\n", report.machine);
    }
    format!(
        "{}: {} blocks, {} of {most} warps ({:.1} %), limited by {limiter}\n",
        report.machine,
        o.blocks,
        o.warps,
        100.0 * report.occupancy_share
    )
}
