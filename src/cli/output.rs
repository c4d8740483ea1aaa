//! Text out: a reader that goes away early (`caribou info | head`) is no error.

use std::io::Write;

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

/// Prints a warning.
pub fn warn(text: &str) {
    let _ = writeln!(std::io::stderr(), "warning: {text}");
}

/// Prints an error.
pub fn error(error: &Error) {
    let _ = writeln!(std::io::stderr(), "error: {error}");
}
