//! The progress bar: on a terminal only.

use std::io::IsTerminal;
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};

use crate::render::integrator::Progress;

/// A bar over camera rays, with rays of all kinds a second and the time left.
pub struct Bar {
    bar: ProgressBar,
    start: Instant,
}

impl Bar {
    /// Hidden if `quiet` or if standard error is no terminal.
    pub fn new(quiet: bool) -> Bar {
        let bar = if quiet || !std::io::stderr().is_terminal() { ProgressBar::hidden() } else { ProgressBar::new(0) };
        let style = ProgressStyle::with_template("{bar:32} {percent:>3} %  {msg}  {eta} left");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Bar { bar, start: Instant::now() }
    }

    /// Shows how far the picture is.
    pub fn update(&self, progress: Progress) {
        self.bar.set_length(progress.total);
        self.bar.set_position(progress.done);
        let rate = progress.rays as f64 / self.start.elapsed().as_secs_f64().max(1e-9);
        self.bar.set_message(format!("{:.2} Mrays/s", rate * 1e-6));
    }

    /// Removes the bar.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
