//! `caribou occupancy`: how many warps of a kernel a multiprocessor holds, and why no more.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use super::output;
use crate::atomic_file::check_writable;
use crate::fermi::machine::{Machine, Rule};
use crate::fermi::occupancy::{self, Demand};
use crate::report::chart::Format;
use crate::report::occupancy_chart::charts;
use crate::shared::WARP;
use crate::{Error, Result};

/// Show how many warps of a kernel a multiprocessor holds, and what limits them
#[derive(Args)]
pub struct Occupancy {
    /// Registers a thread
    #[arg(long, value_name = "R", required_unless_present = "pipeline")]
    regs: Option<u32>,
    /// Registers as the driver told of this pipeline in a benchmark, e.g. direct
    #[arg(long, value_name = "NAME", requires = "bench", conflicts_with = "regs")]
    pipeline: Option<String>,
    /// That benchmark: a file that `caribou bench --json` wrote
    #[arg(long, value_name = "FILE", requires = "pipeline")]
    bench: Option<PathBuf>,
    /// Threads a block
    #[arg(long, value_name = "T", default_value_t = WARP)]
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

/// Most registers that any machine gives a thread.
const MOST_REGISTERS: u32 = 255;

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
        let registers = self.registers()?;
        let demand = Demand { registers, threads: self.threads, shared: self.shared };
        let occupancy = occupancy::occupancy(&machine.sm, demand);
        let report = Report {
            rule: machine.sm.rule,
            registers,
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

    fn registers(&self) -> Result<u32> {
        match (self.regs, &self.pipeline, &self.bench) {
            (None, Some(pipeline), Some(bench)) => registers_of(bench, pipeline),
            (registers, ..) => Ok(registers.unwrap_or_default()),
        }
    }

    fn check(&self) -> Result<()> {
        if !(1..=1024).contains(&self.threads) {
            return Err(Error::usage(format!("--threads {}", self.threads), "allowed are 1 to 1024"));
        }
        if let Some(registers) = self.regs.filter(|&registers| registers > MOST_REGISTERS) {
            return Err(Error::usage(format!("--regs {registers}"), format!("allowed are 0 to {MOST_REGISTERS}")));
        }
        if let Some(path) = &self.output {
            Format::of("-o", path)?;
            check_writable(path)?;
        }
        self.json.iter().filter(|path| path.as_os_str() != "-").try_for_each(|path| check_writable(path))
    }
}

/// Registers a thread that the driver told of `pipeline` in the benchmark `path`.
fn registers_of(path: &Path, pipeline: &str) -> Result<u32> {
    let bad = |object: &str, problem: String, remedy: &str| Error::input(path, object, problem, remedy);
    let text = std::fs::read_to_string(path).map_err(Error::io("read", path))?;
    let bench: serde_json::Value = serde_json::from_str(&text)
        .map_err(|error| bad("file", error.to_string(), "give a file that caribou bench --json wrote"))?;
    let Some(kernels) = bench["kernels"].as_object().filter(|kernels| !kernels.is_empty()) else {
        let remedy = "bench on a driver with VK_KHR_pipeline_executable_properties";
        return Err(bad("kernels", "the driver of that run told nothing of its pipelines".to_owned(), remedy));
    };
    let Some(statistics) = kernels.get(pipeline).and_then(|statistics| statistics.as_object()) else {
        let known: Vec<&str> = kernels.keys().map(String::as_str).collect();
        return Err(bad("kernels", format!("there is no {pipeline}"), &format!("known are {}", known.join(", "))));
    };
    // Drivers name their statistics as they like: NVIDIA's is "Register Count".
    let registers = statistics.iter().find(|(name, _)| name.to_lowercase().contains("register"));
    registers
        .and_then(|(_, count)| count.as_u64().or(count.as_f64().map(|count| count as u64)))
        .and_then(|count| u32::try_from(count).ok().filter(|&count| count <= MOST_REGISTERS))
        .ok_or_else(|| bad(pipeline, "no count of registers".to_owned(), "give the number with --regs"))
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
