//! `caribou bench`: rays a second, counters and digests.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::input::{DeviceArguments, MachineArguments, Prepared, SceneArguments};
use super::output;
use crate::atomic_file::check_writable;
use crate::layout::Frame;
use crate::render::rays::RayKind;
use crate::render::settings::Settings;
use crate::report::baseline::{Baseline, Share};
use crate::report::bench::{Bench as Bencher, GpuBench, Report, SCHEMA, TwinBench, measure};
use crate::report::bench_export;
use crate::report::bench_table::table;
use crate::report::head::Head;
use crate::report::machine::Machine;
use crate::report::ray_dump;
use crate::report::scene::SceneSummary;
use crate::trace::step_sample::sample;
use crate::trace::{NodeFormat, Strategy, TracerOptions};
use crate::vulkan::Gpu;
use crate::{Error, Result, scene};

/// Measure rays a second, and count what they do in the tree
#[derive(Args)]
pub struct Bench {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    device: DeviceArguments,
    /// Pixels across
    #[arg(long, default_value_t = Settings::default().width)]
    width: u32,
    /// Pixels down
    #[arg(long, default_value_t = Settings::default().height)]
    height: u32,
    /// Kinds of rays, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = RayKind::ALL)]
    rays: Vec<RayKind>,
    /// How rays are scheduled: direct, persistent, migrate, several of them separated by commas, or all
    #[arg(long, value_name = "LIST", value_enum, value_delimiter = ',', default_value = "direct")]
    strategy: Vec<StrategyChoice>,
    #[command(flatten)]
    machine: MachineArguments,
    /// How nodes are stored, one format or both separated by a comma; hits are the same
    #[arg(long, value_name = "LIST", value_enum, value_delimiter = ',', default_value = "full")]
    nodes: Vec<NodeFormat>,
    /// exact: hits as on every other device; driver: the driver's own rounding, to see what exactness costs
    #[arg(long, value_enum, default_value_t)]
    arithmetic: Arithmetic,
    /// Timed runs after the warm-up
    #[arg(long, default_value_t = 9)]
    runs: usize,
    /// Length of ambient occlusion rays; by default a tenth of the scene's diagonal
    #[arg(long, value_name = "LENGTH", allow_negative_numbers = true)]
    ao_radius: Option<f32>,
    /// Seed of the secondary rays
    #[arg(long, default_value_t = Settings::default().seed)]
    seed: u32,
    /// Also write the report (schema caribou-bench/1) to a file, or to standard output with -
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Compare with an earlier report: counters and hits exactly, times by their intervals; exit with 1 if a counter
    /// changed or a row became slower
    #[arg(long, value_name = "FILE")]
    baseline: Option<PathBuf>,
    /// By how much a row may be slower than the baseline even if that is certain: 2% or 0.02
    #[arg(long, value_name = "SHARE", default_value = "2%", allow_hyphen_values = true, requires = "baseline")]
    fail_above: Share,
    /// Also write the report for Bencher (Bencher Metric Format)
    #[arg(long, value_name = "FILE")]
    export_bencher: Option<PathBuf>,
    /// Also write the report for github-action-benchmark (tool: customSmallerIsBetter)
    #[arg(long, value_name = "FILE")]
    export_github_action: Option<PathBuf>,
    /// Write triangles, rays and hits of the one kind of rays asked for, for other programs to check
    #[arg(long, value_name = "FILE")]
    dump_rays: Option<PathBuf>,
    /// Write where each ray went in the tree (format: caribou::trace::step_sample) for the one kind of rays and the
    /// one strategy asked for
    #[arg(long, value_name = "FILE")]
    step_trace: Option<PathBuf>,
    /// Record so many rays at even distances instead of all
    #[arg(long, value_name = "N", requires = "step_trace")]
    trace_rays: Option<u64>,
    /// Print no table
    #[arg(short, long)]
    quiet: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum StrategyChoice {
    /// One invocation a ray
    Direct,
    /// A fixed number of invocations take rays from a common counter
    Persistent,
    /// Rays travel to the SM that owns the subtree they must visit
    Migrate,
    /// All there are
    All,
}

impl StrategyChoice {
    fn strategies(self) -> &'static [Strategy] {
        match self {
            StrategyChoice::Direct => &[Strategy::Direct],
            StrategyChoice::Persistent => &[Strategy::Persistent],
            StrategyChoice::Migrate => &[Strategy::Migrate],
            StrategyChoice::All => &Strategy::ALL,
        }
    }
}

#[derive(Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
enum Arithmetic {
    /// Correctly rounded.
    #[default]
    Exact,
    /// As the driver rounds.
    Driver,
}

impl Bench {
    /// Measures, reports, and compares with the baseline.
    pub fn run(&self) -> Result<()> {
        self.check()?;
        let baseline = self.baseline.as_deref().map(Baseline::read).transpose()?;
        let report = self.measure(baseline.as_ref())?;
        self.write(&report)?;
        let comparison = baseline.map(|baseline| baseline.compare(&report, self.fail_above)).transpose()?;
        if !self.quiet && self.json.as_ref().is_none_or(|path| path.as_os_str() != "-") {
            let changes = comparison.as_ref().map(|comparison| comparison.table());
            output::print(&(table(&report) + &changes.unwrap_or_default()))?;
        }
        comparison.map_or(Ok(()), |comparison| comparison.judge())
    }

    fn write(&self, report: &Report) -> Result<()> {
        if let Some(path) = &self.json {
            output::write_json(path, report)?;
        }
        if let Some(path) = &self.export_bencher {
            output::write_json(path, &bench_export::bencher(report))?;
        }
        if let Some(path) = &self.export_github_action {
            output::write_json(path, &bench_export::github_action(report))?;
        }
        Ok(())
    }

    fn measure(&self, baseline: Option<&Baseline>) -> Result<Report> {
        let gpu = self.device.open()?;
        let prepared = self.scene.prepare(self.quiet)?;
        let camera = scene::select_camera(&prepared.scene, self.scene.camera.as_deref())?;
        let ao_radius = self.ao_radius.unwrap_or_else(|| Settings::default_ao_radius(prepared.bvh.bounds));
        let mut report = self.empty_report(gpu.as_ref(), &prepared, ao_radius);
        if let Some(baseline) = baseline {
            baseline.check(&report)?;
        }
        let frame = self.settings(ao_radius).frame(&camera);
        for options in self.tracings() {
            self.measure_tracing(&options, gpu.as_ref(), &prepared, frame, &mut report)?;
        }
        match gpu.iter().flat_map(|gpu| gpu.validation_messages()).next() {
            Some(message) => Err(Error::Check(format!("validation: {message}"))),
            None => Ok(report),
        }
    }

    fn measure_tracing(
        &self,
        options: &TracerOptions,
        gpu: Option<&Gpu>,
        Prepared { scene, bvh, tables, .. }: &Prepared,
        frame: Frame,
        report: &mut Report,
    ) -> Result<()> {
        let mut bencher: Box<dyn Bencher> = match gpu {
            Some(gpu) => {
                let bencher = GpuBench::new(gpu, (bvh, tables), frame, options)?;
                report.kernels.extend(bencher.kernels()?);
                Box::new(bencher)
            }
            None => Box::new(TwinBench::new((bvh, tables), frame, options)?),
        };
        for &kind in &self.rays {
            let rays = bencher.rays(kind)?;
            let (outcome, traced) = measure(bencher.as_mut(), options, kind, &rays, self.runs)?;
            if let Some(path) = &self.step_trace {
                let rays_wanted = sample(rays.len() as u64, self.trace_rays.unwrap_or(u64::MAX));
                bencher.record(kind, &rays, rays_wanted)?.write(path)?;
            }
            if let Some(path) = &self.dump_rays {
                ray_dump::write(path, &scene.positions, kind.query(), &rays, &traced.hits)?;
            }
            report.results.push(outcome);
        }
        Ok(())
    }

    fn empty_report(&self, gpu: Option<&Gpu>, prepared: &Prepared, ao_radius: f32) -> Report {
        Report {
            head: Head {
                schema: SCHEMA,
                machine: Machine::new(gpu),
                scene: SceneSummary::new(&prepared.scene, &prepared.bvh),
                width: self.width,
                height: self.height,
            },
            ao_radius,
            seed: self.seed,
            arithmetic: if self.arithmetic == Arithmetic::Driver { "driver" } else { "exact" },
            kernels: BTreeMap::new(),
            results: Vec::new(),
        }
    }

    /// Each strategy with each format of nodes.
    fn tracings(&self) -> Vec<TracerOptions> {
        let strategies = self.strategy.iter().flat_map(|choice| choice.strategies());
        let with = |strategy: Strategy, nodes: NodeFormat| TracerOptions {
            strategy,
            nodes,
            machine: self.machine.options(),
            driver_arithmetic: self.arithmetic == Arithmetic::Driver,
            ..TracerOptions::default()
        };
        strategies.flat_map(|&strategy| self.nodes.iter().map(move |&nodes| with(strategy, nodes))).collect()
    }

    fn settings(&self, ao_radius: f32) -> Settings {
        Settings { width: self.width, height: self.height, seed: self.seed, ao_radius, ..Settings::default() }
    }

    /// Refuses what cannot be done before any work.
    fn check(&self) -> Result<()> {
        self.settings(self.ao_radius.unwrap_or(1.0)).check()?;
        if !(1..=10_000).contains(&self.runs) {
            return Err(Error::usage(format!("--runs {}", self.runs), "allowed are 1 to 10000"));
        }
        let tracings = self.tracings();
        tracings.iter().try_for_each(TracerOptions::check)?;
        if self.dump_rays.is_some() && self.rays.len() != 1 {
            return Err(Error::usage("--dump-rays with several kinds of rays", "name one with --rays"));
        }
        if self.step_trace.is_some() && (self.rays.len(), tracings.len()) != (1, 1) {
            return Err(Error::usage(
                "--step-trace with several kinds of rays, strategies or formats of nodes",
                "name one of each with --rays, --strategy and --nodes",
            ));
        }
        if self.trace_rays == Some(0) {
            return Err(Error::usage("--trace-rays 0", "give a number from 1 on"));
        }
        let printable = self.json.iter().chain(&self.export_bencher).chain(&self.export_github_action);
        for path in printable.filter(|path| path.as_os_str() != "-").chain(&self.dump_rays).chain(&self.step_trace) {
            check_writable(path)?;
        }
        Ok(())
    }
}
