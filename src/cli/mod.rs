//! Command line: one file a subcommand, arguments in, typed request out.

mod bench;
mod diff;
mod info;
mod input;
mod memory;
mod model;
mod occupancy;
mod output;
mod paper;
mod progress;
mod render;
mod scene;
mod stability;
mod study;
mod tolerance;
mod verify;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::Result;

/// Headless glTF-to-OpenEXR ray tracer on Vulkan compute, with counters that repeat on every device.
#[derive(Parser)]
#[command(name = "caribou", version, max_term_width = 100)]
#[command(after_help = "Exit codes: 0 ok, 1 the work or the check failed, 2 bad input or usage.")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// Say more about what is done (RUST_LOG sets it in detail).
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    verbose: u8,
}

#[derive(Subcommand)]
enum Command {
    Render(render::Render),
    Info(info::Info),
    Bench(bench::Bench),
    Diff(diff::Diff),
    Scene(scene::SceneCommand),
    Verify(verify::Verify),
    Model(Box<model::Model>),
    Occupancy(occupancy::Occupancy),
    Paper(Box<paper::Paper>),
    Stability(stability::Stability),
    Study(study::Study),
}

/// Runs the program on `args` (the program's name first) and returns its exit code:
/// 0 ok, 1 the work or check failed, 2 bad input or usage.
pub fn run(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments = match Arguments::try_parse_from(args) {
        Ok(arguments) => arguments,
        Err(error) => {
            // Help and version are no errors; a closed pipe is none either.
            let _ = error.print();
            return ExitCode::from(if error.use_stderr() { 2 } else { 0 });
        }
    };
    log_to_stderr(arguments.verbose);
    let result = match arguments.command {
        Command::Render(command) => command.run(),
        Command::Info(command) => command.run(),
        Command::Bench(command) => command.run(),
        Command::Diff(command) => command.run(),
        Command::Scene(command) => command.run(),
        Command::Verify(command) => command.run(),
        Command::Model(command) => command.run(),
        Command::Occupancy(command) => command.run(),
        Command::Paper(command) => command.run(),
        Command::Stability(command) => command.run(),
        Command::Study(command) => command.run(),
    };
    finish(result)
}

fn finish(result: Result<()>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            output::error(&error);
            ExitCode::from(error.exit_code())
        }
    }
}

fn log_to_stderr(verbose: u8) {
    use tracing_subscriber::EnvFilter;
    let level = ["warn", "info", "debug", "trace"][usize::from(verbose.min(3))];
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(level));
    // A second call in one process (tests) finds the logger in place.
    let _ = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).try_init();
}
