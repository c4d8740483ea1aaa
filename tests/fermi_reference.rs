//! The Fermi model against the runs of an independent cycle-level simulator (`../shared/reference`), which are
//! not part of the repository: without them, or without the programs that rebuild their cases, the tests say so
//! and pass.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::{Path, PathBuf};
use std::process::Command;

use caribou::fermi::result::Fidelity;
use caribou::report::reference::{Row, Run, compare, errors, read_runs, table};

/// Cases as the reference's README makes them: mesh, and the arguments of `make_case`.
const CASES: [(&str, &[&str]); 4] = [
    ("conference_clean", &["128", "96", "conf_128", "4", "cam=0.15,0.6,0.2,0.6,0.3,0.7,65"]),
    ("conference_clean", &["256", "192", "conf_256", "4", "cam=0.15,0.6,0.2,0.6,0.3,0.7,65"]),
    ("dragon", &["128", "96", "dragon_128", "4", "cam=0.62,0.75,2.9,0.5,0.45,0.5,40"]),
    ("sphere:400:200", &["64", "48", "s160k_64", "4"]),
];

fn shared() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared")
}

fn run(command: &mut Command) -> Result<(), String> {
    match command.output() {
        Ok(output) if output.status.success() => Ok(()),
        Ok(output) => Err(format!("{command:?}: {}", String::from_utf8_lossy(&output.stderr))),
        Err(error) => Err(format!("{command:?}: {error}")),
    }
}

/// Rebuilds the cases in `folder`.
fn make_cases(folder: &Path) -> Result<(), String> {
    let reference = shared().join("reference");
    let program = folder.join("make_case");
    run(Command::new("g++").arg("-O2").arg("-o").arg(&program).arg(reference.join("make_case.cpp")))?;
    for (mesh, arguments) in CASES {
        let glb = shared().join(format!("scenes/{mesh}.glb"));
        let mut source = mesh.to_owned();
        if !mesh.contains(':') {
            source = format!("{mesh}.raw");
            if !folder.join(&source).exists() {
                run(Command::new("python3").arg(reference.join("glb_to_raw.py")).arg(glb).arg(folder.join(&source)))?;
            }
        }
        run(Command::new(&program).arg(source).args(arguments).current_dir(folder))?;
    }
    Ok(())
}

/// Runs of 3.2.2, the simulator that the model's constants describe, and a folder with their cases.
fn reference() -> Option<(Vec<Run>, tempfile::TempDir)> {
    let file = shared().join("reference/gpgpusim.json");
    if !file.exists() {
        eprintln!("SKIPPED: {} is not there", file.display());
        return None;
    }
    let folder = tempfile::tempdir().unwrap();
    if let Err(problem) = make_cases(folder.path()) {
        eprintln!("SKIPPED: the reference cases cannot be rebuilt: {problem}");
        return None;
    }
    let runs = read_runs(&file).unwrap().into_iter().filter(|run| run.simulator == "3.2.2").collect();
    Some((runs, folder))
}

fn check(rows: &[Row], mean_bound: f64, worst_bound: f64) {
    let text = table(rows);
    let (mean, worst) = errors(rows.iter(), |row| row.cycles_error);
    assert!(mean <= mean_bound && worst <= worst_bound, "{text}");
    // The accesses follow from the traces alone, so they must be exact.
    assert!(rows.iter().all(|row| row.l1_accesses_difference == 0), "{text}");
    assert!(rows.iter().all(|row| row.instructions_error.abs() < 0.01), "{text}");
}

#[test]
fn predictions_agree_with_the_reference_simulator() {
    let Some((runs, cases)) = reference() else { return };
    let rows = compare(&runs, cases.path(), Fidelity::Cycles, &[]).unwrap();
    check(&rows, 0.08, 0.20);
    let (misses, _) = errors(rows.iter(), |row| row.l1_miss_rate_error);
    assert!(misses <= 0.04, "{}", table(&rows));

    let rows = compare(&runs, cases.path(), Fidelity::Caches, &[]).unwrap();
    check(&rows, 0.15, 0.30);
}
