//! Predictions beside the runs of an independent simulator.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use cpu_time::ThreadTime;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::experiment::{Model, Recorded};
use crate::fermi::result::{Fidelity, Prediction};
use crate::trace::Strategy;

use crate::trace::exchange::{read_hits, read_rays, read_tree, record_reference};
use crate::{Error, Result};

/// Kernel of the reference runs.
const KERNEL: &str = "while-while";

/// One run of the simulator.
#[derive(Clone, Debug, Deserialize)]
pub struct Run {
    /// Version of the simulator.
    pub simulator: String,
    /// Name of the case.
    pub case: String,
    /// Name of the batch of rays.
    pub batch: String,
    /// Multiprocessors.
    pub sms: u32,
    /// Capacity of the L1.
    pub l1_kib: u64,
    /// Rays traced.
    pub rays: u64,
    /// Core cycles.
    pub cycles: u64,
    /// Misses of the L1 an access.
    pub l1_miss_rate: f64,
    /// Accesses of the L1.
    pub l1_accesses: u64,
    /// Warp instructions.
    pub warp_instructions: u64,
    /// CPU seconds of the simulator, where known.
    pub simulator_cpu_s: Option<f64>,
}

/// A run and its prediction.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Version of the simulator.
    pub simulator: String,
    /// Name of the case.
    pub case: String,
    /// Name of the batch of rays.
    pub batch: String,
    /// Multiprocessors.
    pub sms: u32,
    /// Capacity of the L1.
    pub l1_kib: u64,
    /// The simulator's cycles.
    pub reference_cycles: u64,
    /// Predicted cycles over the simulator's, less 1.
    pub cycles_error: f64,
    /// The simulator's miss rate.
    pub reference_l1_miss_rate: f64,
    /// Predicted miss rate over the simulator's, less 1.
    pub l1_miss_rate_error: f64,
    /// Predicted accesses of the L1 less the simulator's.
    pub l1_accesses_difference: i64,
    /// Predicted warp instructions over the simulator's, less 1.
    pub instructions_error: f64,
    /// CPU seconds of the prediction, tracing not counted.
    pub cpu_s: f64,
    /// The simulator's CPU seconds over the prediction's.
    pub times_faster: Option<f64>,
    /// The prediction.
    pub prediction: Prediction,
}

/// Reads the runs of a reference file.
///
/// # Errors
/// [`Error::Io`] or [`Error::Input`].
pub fn read_runs(path: &Path) -> Result<Vec<Run>> {
    let text = std::fs::read_to_string(path).map_err(Error::io("read", path))?;
    serde_json::from_str(&text)
        .map_err(|error| Error::input(path, "runs", error.to_string(), "give a list of runs as the simulator wrote it"))
}

/// Refuses runs that cannot be compared with: none at all, of unknown simulators, or of cases that the folder `cases`
/// does not have.
///
/// # Errors
/// [`Error::Input`] that names `file`.
pub fn check_runs(runs: &[Run], file: &Path, cases: &Path) -> Result<()> {
    if runs.is_empty() {
        return Err(Error::input(file, "runs", "there are none", "give a list of runs as the simulator wrote it"));
    }
    for run in runs {
        let object = format!("run of {} {}", run.case, run.batch);
        machine_of(run, &[]).map_err(|error| Error::input(file, &object, error.to_string(), "leave that run out"))?;
        let needed = [case_file(cases, run, "bvh"), case_file(cases, run, "rays")];
        if let Some(missing) = needed.iter().find(|path| !path.is_file()) {
            let problem = format!("{} is not there", missing.display());
            return Err(Error::input(file, object, problem, "give the folder with this file's cases"));
        }
    }
    Ok(())
}

/// The tree of a run's case, or the rays or hits of its batch.
fn case_file(cases: &Path, run: &Run, kind: &str) -> PathBuf {
    cases.join(if kind == "bvh" { format!("{}.bvh", run.case) } else { format!("{}.{}.{kind}", run.case, run.batch) })
}

/// The machine that `run` was made on, and its settings.
///
/// # Errors
/// [`Error::Usage`] if the simulator is unknown.
pub fn machine_of(run: &Run, overrides: &[String]) -> Result<(&'static str, Vec<String>)> {
    let name = match run.simulator.as_str() {
        "3.2.2" => "gpgpusim-3.2.2",
        "4.2.0" => "gpgpusim-4.2",
        other => return Err(Error::usage(format!("simulator {other}"), "known are 3.2.2 and 4.2.0")),
    };
    let mut settings = vec![format!("sms={}", run.sms), format!("l1.kib={}", run.l1_kib)];
    settings.extend(overrides.iter().cloned());
    Ok((name, settings))
}

/// Predicts each of `runs` from the files of its case in `cases`.
///
/// # Errors
/// As of reading the files, or [`Error::Check`] if the recorder finds other hits than the files have.
pub fn compare(runs: &[Run], cases: &Path, fidelity: Fidelity, overrides: &[String]) -> Result<Vec<Row>> {
    runs.par_iter().map(|run| row(run, cases, fidelity, overrides)).collect()
}

fn row(run: &Run, cases: &Path, fidelity: Fidelity, overrides: &[String]) -> Result<Row> {
    let file = |kind| case_file(cases, run, kind);
    let tree = read_tree(&file("bvh"))?;
    let rays = read_rays(&file("rays"))?;
    let (hits, trace) = record_reference(&tree, &rays);
    let expected = file("hits");
    if expected.exists() {
        let expected = read_hits(&expected, tree.triangles.len())?;
        let differ = expected.iter().zip(&hits).filter(|(a, b)| a.prim != b.prim).count();
        if expected.len() != hits.len() || differ > 0 {
            return Err(Error::Check(format!("{} {}: {differ} hits differ from the file's", run.case, run.batch)));
        }
    }
    let recorded = Recorded { trace: &trace, children: &tree.children, triangles: tree.triangles.len() };
    let (machine, settings) = machine_of(run, overrides)?;
    let model = Model::new(machine, KERNEL, &settings, fidelity)?;
    let start = ThreadTime::now();
    let prediction = model.whole(&recorded, Strategy::Direct)?;
    let cpu_s = start.elapsed().as_secs_f64();
    Ok(Row {
        simulator: run.simulator.clone(),
        case: run.case.clone(),
        batch: run.batch.clone(),
        sms: run.sms,
        l1_kib: run.l1_kib,
        reference_cycles: run.cycles,
        cycles_error: prediction.cycles as f64 / run.cycles as f64 - 1.0,
        reference_l1_miss_rate: run.l1_miss_rate,
        l1_miss_rate_error: prediction.l1.miss_rate / run.l1_miss_rate - 1.0,
        l1_accesses_difference: prediction.l1.counts.accesses as i64 - run.l1_accesses as i64,
        instructions_error: prediction.instructions.warp as f64 / run.warp_instructions as f64 - 1.0,
        cpu_s,
        times_faster: run.simulator_cpu_s.map(|seconds| seconds / cpu_s),
        prediction,
    })
}

/// Mean and largest magnitude of one simulator's errors.
pub fn errors<'a>(rows: impl Iterator<Item = &'a Row>, error: impl Fn(&Row) -> f64) -> (f64, f64) {
    let all: Vec<f64> = rows.map(|row| error(row).abs()).collect();
    (all.iter().sum::<f64>() / all.len().max(1) as f64, all.iter().copied().fold(0.0, f64::max))
}

/// The comparison as a table.
pub fn table(rows: &[Row]) -> String {
    let mut text = format!(
        "{:<6} {:<11} {:<5} {:>3} {:>3} {:>9} {:>9} {:>7} {:>7} {:>7} {:>7} {:>6} {:>7} {:>7}\n",
        "sim",
        "case",
        "batch",
        "SMs",
        "KiB",
        "cycles",
        "sim's",
        "error",
        "L1 miss",
        "sim's",
        "error",
        "instr",
        "CPU s",
        "faster"
    );
    for r in rows {
        let percent = |x: f64| format!("{:+.1}%", 100.0 * x);
        let _ = writeln!(
            text,
            "{:<6} {:<11} {:<5} {:>3} {:>3} {:>9} {:>9} {:>7} {:>7.4} {:>7.4} {:>7} {:>6} {:>7.2} {:>7}",
            r.simulator,
            r.case,
            r.batch,
            r.sms,
            r.l1_kib,
            r.prediction.cycles,
            r.reference_cycles,
            percent(r.cycles_error),
            r.prediction.l1.miss_rate,
            r.reference_l1_miss_rate,
            percent(r.l1_miss_rate_error),
            percent(r.instructions_error),
            r.cpu_s,
            r.times_faster.map_or("-".to_owned(), |x| format!("{x:.0}x"))
        );
    }
    let mut simulators: Vec<&str> = rows.iter().map(|row| row.simulator.as_str()).collect();
    simulators.dedup();
    for simulator in simulators {
        let own = || rows.iter().filter(|row| row.simulator == simulator);
        let (cycles, worst) = errors(own(), |row| row.cycles_error);
        let (misses, _) = errors(own(), |row| row.l1_miss_rate_error);
        let _ = writeln!(
            text,
            "{simulator}: error of cycles {:.1} % mean, {:.1} % worst; of the L1 miss rate {:.1} % mean",
            100.0 * cycles,
            100.0 * worst,
            100.0 * misses
        );
    }
    text
}
