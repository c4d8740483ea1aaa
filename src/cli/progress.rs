//! The progress bar: on a terminal only.

use std::io::IsTerminal;
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};

use crate::render::integrator::Progress;

/// Length of the bar.
const STEPS: u64 = 1000;

/// A bar over what is done, with rays of all kinds a second and the time left.
pub struct Bar {
    bar: ProgressBar,
    start: Instant,
}

impl Bar {
    /// Hidden if `quiet` or if standard error is no terminal.
    pub fn new(quiet: bool) -> Bar {
        Bar { bar: bar("{bar:32} {percent:>3} % {msg}  {eta} left", quiet, STEPS), start: Instant::now() }
    }

    /// Shows how far the picture is.
    pub fn update(&self, progress: Progress) {
        self.bar.set_position((progress.share.clamp(0.0, 1.0) * STEPS as f64) as u64);
        let rate = progress.rays as f64 / self.start.elapsed().as_secs_f64().max(1e-9);
        self.bar.set_message(format!("{}, {:.2} Mrays/s", progress.unit, rate * 1e-6));
    }

    /// Removes the bar.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// A bar over things that are done one after the other.
pub struct Count(ProgressBar);

impl Count {
    /// Of things called `what`; hidden if `quiet` or if standard error is no terminal.
    pub fn new(what: &str, quiet: bool) -> Count {
        Count(bar(&format!("{{bar:32}} {{pos}} of {{len}} {what}  {{eta}} left"), quiet, 0))
    }

    /// Shows how many are done.
    pub fn update(&self, done: usize, total: usize) {
        self.0.set_length(total as u64);
        self.0.set_position(done as u64);
    }

    /// Removes the bar.
    pub fn finish(&self) {
        self.0.finish_and_clear();
    }
}

fn bar(template: &str, quiet: bool, length: u64) -> ProgressBar {
    let bar = if quiet || !std::io::stderr().is_terminal() { ProgressBar::hidden() } else { ProgressBar::new(length) };
    bar.set_style(ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}
