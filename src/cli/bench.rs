//! `caribou bench`: rays a second, counters and digests.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::input::{DeviceArguments, MachineArguments, SceneArguments};
use super::output;
use crate::atomic_file::check_writable;
use crate::render::rays::RayKind;
use crate::render::settings::Settings;
use crate::report::bench::{Bench as Bencher, GpuBench, Outcome, Report, TwinBench, measure};
use crate::report::head::Head;
use crate::report::machine::Machine;
use crate::report::ray_dump;
use crate::report::scene::SceneSummary;
use crate::trace::accounting::SmCounters;
use crate::trace::step_sample::sample;
use crate::trace::{NodeFormat, Strategy, TracerOptions};
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
    /// Measures and reports.
    pub fn run(&self) -> Result<()> {
        let report = self.measure()?;
        if let Some(path) = &self.json {
            output::write_json(path, &report)?;
        }
        if self.quiet || self.json.as_ref().is_some_and(|path| path.as_os_str() == "-") {
            return Ok(());
        }
        output::print(&table(&report))
    }

    fn measure(&self) -> Result<Report> {
        self.check()?;
        let gpu = self.device.open()?;
        let prepared = self.scene.prepare(self.quiet)?;
        let camera = scene::select_camera(&prepared.scene, self.scene.camera.as_deref())?;
        let settings =
            self.settings(self.ao_radius.unwrap_or_else(|| Settings::default_ao_radius(prepared.bvh.bounds)));
        let frame = settings.frame(&camera);
        let (bvh, tables) = (&prepared.bvh, &prepared.tables);
        let mut kernels = BTreeMap::new();
        let mut results: Vec<Outcome> = Vec::new();
        for options in self.tracings() {
            let mut bencher: Box<dyn Bencher> = match &gpu {
                Some(gpu) => {
                    let bencher = GpuBench::new(gpu, (bvh, tables), frame, &options)?;
                    kernels.extend(bencher.kernels()?);
                    Box::new(bencher)
                }
                None => Box::new(TwinBench::new((bvh, tables), frame, &options)?),
            };
            for &kind in &self.rays {
                let rays = bencher.rays(kind)?;
                let (outcome, traced) = measure(bencher.as_mut(), &options, kind, &rays, self.runs)?;
                if let Some(path) = &self.step_trace {
                    let rays_wanted = sample(rays.len() as u64, self.trace_rays.unwrap_or(u64::MAX));
                    bencher.record(kind, &rays, rays_wanted)?.write(path)?;
                }
                if let Some(path) = &self.dump_rays {
                    ray_dump::write(path, &prepared.scene.positions, &rays, &traced.hits)?;
                }
                results.push(outcome);
            }
        }
        if let Some(message) = gpu.iter().flat_map(|gpu| gpu.validation_messages()).next() {
            return Err(Error::Check(format!("validation: {message}")));
        }
        Ok(Report {
            head: Head {
                schema: "caribou-bench/1",
                machine: Machine::new(gpu.as_ref()),
                scene: SceneSummary::new(&prepared.scene, bvh),
                width: self.width,
                height: self.height,
            },
            ao_radius: settings.ao_radius,
            arithmetic: if self.arithmetic == Arithmetic::Driver { "driver" } else { "exact" },
            kernels,
            results,
        })
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
        for path in
            self.json.iter().filter(|path| path.as_os_str() != "-").chain(&self.dump_rays).chain(&self.step_trace)
        {
            check_writable(path)?;
        }
        Ok(())
    }
}

fn table(report: &Report) -> String {
    let Head { machine, scene, width, height, .. } = &report.head;
    let mut text = format!("{}: {} triangles, {width} x {height}, {}\n\n", scene.name, scene.triangles, machine.device);
    let _ = writeln!(
        text,
        "{:<10} {:<9} {:<8} {:>10} {:>10} {:>22} {:>10} {:>10} {:>6}  hits digest",
        "strategy", "nodes", "rays", "count", "hits", "Mrays/s (95 %)", "nodes/ray", "tests/ray", "SIMD"
    );
    for r in &report.results {
        let each = |sum: u64| sum as f64 / r.ray_count.max(1) as f64;
        let rate = r.mrays_per_s.map_or("-".to_owned(), |m| format!("{:.3} ({:.3}-{:.3})", m.median, m.low, m.high));
        let _ = writeln!(
            text,
            "{:<10} {:<9} {:<8} {:>10} {:>10} {:>22} {:>10.2} {:>10.2} {:>6.3}  {}",
            r.tracing.strategy.name(),
            r.tracing.nodes.name(),
            r.rays.name(),
            r.ray_count,
            r.hits,
            rate,
            each(r.counters.node_visits),
            each(r.counters.triangle_tests),
            r.warps.simd_efficiency(),
            r.hits_digest
        );
    }
    migration_table(&mut text, report);
    for (kernel, statistics) in &report.kernels {
        let parts: Vec<String> = statistics.iter().map(|(name, value)| format!("{name} {value}")).collect();
        let _ = writeln!(text, "{kernel}: {}", parts.join(", "));
    }
    text
}

/// What explains the speed of strategy `migrate`.
fn migration_table(text: &mut String, report: &Report) {
    for (i, r) in report.results.iter().filter(|r| r.migration.is_some()).enumerate() {
        let Some(migration) = &r.migration else { continue };
        if i == 0 {
            let partition = r.tracing.partition.as_deref().unwrap_or_default();
            let _ = writeln!(text, "\nmigrate, {partition}; a ray's means");
            let _ = writeln!(
                text,
                "{:<8} {:>9} {:>9} {:>9} {:>9} {:>9} {:>7} {:>11} {:>9} {:>10}",
                "rays",
                "top nodes",
                "subtrees",
                "bypasses",
                "migrated",
                "bytes",
                "rounds",
                "mean queue",
                "longest",
                "busiest SM"
            );
        }
        let each = |sum: u64| sum as f64 / migration.rays.max(1) as f64;
        let queued: u64 = migration.rounds.iter().map(|round| round.queued).sum();
        let queues: u64 = migration.rounds.iter().map(|round| round.queues).sum();
        let steps = |sm: &SmCounters| sm.warps.warp_steps;
        let all: u64 = migration.sms.iter().map(steps).sum();
        let busiest = migration.sms.iter().map(steps).max().unwrap_or(0);
        let _ = writeln!(
            text,
            "{:<8} {:>9.2} {:>9.2} {:>9.2} {:>9.2} {:>9.0} {:>7} {:>11.1} {:>9} {:>9.2}x",
            r.rays.name(),
            each(r.counters.top_visits),
            each(r.counters.subtrees),
            each(r.counters.bypasses),
            each(r.counters.migrations),
            each(migration.sms.iter().map(|sm| sm.record_bytes).sum()),
            migration.rounds.len(),
            queued as f64 / queues.max(1) as f64,
            migration.rounds.iter().map(|round| round.longest_queue).max().unwrap_or(0),
            busiest as f64 * migration.sms.len() as f64 / all.max(1) as f64
        );
    }
}
