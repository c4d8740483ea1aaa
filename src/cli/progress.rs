//! The progress bar: on a terminal only.

use std::io::IsTerminal;
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};

use super::output;
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

/// A bar over things that are done one after the other, and lines above it that stay.
pub struct Count {
    bar: ProgressBar,
    quiet: bool,
}

impl Count {
    /// Of things called `what`; hidden if `quiet` or if standard error is no terminal.
    pub fn new(what: &str, quiet: bool) -> Count {
        Count { bar: bar(&format!("{{bar:32}} {{pos}} of {{len}} {what}  {{msg}}  {{elapsed}}"), quiet, 0), quiet }
    }

    /// Shows how many are done.
    pub fn update(&self, done: usize, total: usize) {
        self.bar.set_length(total as u64);
        self.bar.set_position(done as u64);
    }

    /// Shows how many are done; where there is no bar, by a line for each tenth.
    pub fn counted(&self, done: usize, total: usize) {
        self.update(done, total);
        if self.bar.is_hidden() && 10 * done / total > 10 * done.saturating_sub(1) / total {
            self.line(&format!("{:>7.1} s  {done} of {total}", self.bar.elapsed().as_secs_f64()));
        }
    }

    /// Shows what is being done.
    pub fn doing(&self, what: &str) {
        self.bar.set_message(what.to_owned());
    }

    /// Says something, unless quiet; to a file too.
    pub fn line(&self, text: &str) {
        match self.bar.is_hidden() {
            true if !self.quiet => output::note(text),
            _ => self.bar.println(text),
        }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

fn bar(template: &str, quiet: bool, length: u64) -> ProgressBar {
    let bar = if quiet || !std::io::stderr().is_terminal() { ProgressBar::hidden() } else { ProgressBar::new(length) };
    bar.set_style(ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}
