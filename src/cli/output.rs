//! Text out: a reader that goes away early (`caribou info | head`) is no error.

use std::io::Write;
use std::path::Path;

use crate::atomic_file::write_atomically;
use crate::{Error, Result};

/// Prints to standard output.
pub fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::io("write", "standard output")(error))
        }
        _ => Ok(()),
    }
}

/// Prints a value as indented JSON.
pub fn print_json(value: &impl serde::Serialize) -> Result<()> {
    print(&format!("{}\n", json(value)))
}

/// A value as indented JSON.
pub fn json(value: &impl serde::Serialize) -> String {
    // Cannot fail: the reports are structs of numbers, texts and lists, with texts as keys.
    serde_json::to_string_pretty(value).unwrap_or_default()
}

/// Writes a report to a file, or to standard output for `-`.
pub fn write_json(path: &Path, report: &impl serde::Serialize) -> Result<()> {
    if path.as_os_str() == "-" {
        return print_json(report);
    }
    let text = json(report) + "\n";
    write_atomically(path, |file| file.write_all(text.as_bytes()).map_err(Error::io("write", path)))
}

/// Prints a line beside the results.
pub fn note(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Prints a warning.
pub fn warn(text: &str) {
    let _ = writeln!(std::io::stderr(), "warning: {text}");
}

/// Prints an error.
pub fn error(error: &Error) {
    let _ = writeln!(std::io::stderr(), "error: {error}");
}
