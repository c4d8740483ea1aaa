//! The `caribou` program: everything happens in the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    caribou::cli::run(std::env::args_os())
}
