//! Command line: one file a subcommand, arguments in, typed request out.

use std::ffi::OsString;
use std::process::ExitCode;

/// Runs the program on `args` (the program's name first) and returns its exit code:
/// 0 ok, 1 the work or check failed, 2 bad input or usage.
pub fn run(_args: impl IntoIterator<Item = OsString>) -> ExitCode {
    ExitCode::from(2)
}
