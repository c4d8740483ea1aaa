//! How two pictures differ: for people and as `caribou-diff/1`.

use std::fmt::Write;

use serde::Serialize;

use crate::render::compare::picture::Metric;
use crate::render::compare::{ChannelDifference, channel_differences, flip_of, total};
use crate::render::image::Image;

/// Schema `caribou-diff/1`.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Name and version of this format.
    pub schema: &'static str,
    /// Names of both files.
    pub files: [String; 2],
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// One a channel.
    pub channels: Vec<ChannelDifference>,
    /// All channels together, every sample with the same weight.
    pub total: ChannelDifference,
    /// FLIP's mean; none without channels R, G and B.
    pub flip: Option<f64>,
    /// What `value` is.
    pub metric: Metric,
    /// The total by that metric.
    pub value: f64,
}

impl Report {
    /// Of two pictures of the same size and channels; `None` for metric FLIP without channels R, G and B.
    pub fn new(files: [String; 2], (a, b): (&Image, &Image), metric: Metric) -> Option<Report> {
        let channels = channel_differences(a, b);
        let total = total(&channels);
        let flip = flip_of(a, b).map(|f| f.iter().map(|&value| f64::from(value)).sum::<f64>() / f.len() as f64);
        let value = match metric {
            Metric::Rmse => total.rmse,
            Metric::Max => total.max,
            Metric::Flip => flip?,
        };
        let (width, height) = (a.width(), a.height());
        Some(Report { schema: "caribou-diff/1", files, width, height, channels, total, flip, metric, value })
    }

    /// NaN and infinite samples of both pictures.
    pub fn not_finite(&self) -> u64 {
        self.total.not_finite.iter().sum()
    }

    /// A line a channel and one for all.
    pub fn table(&self) -> String {
        let mut text =
            format!("{} against {}, {} x {} pixels\n", self.files[0], self.files[1], self.width, self.height);
        let heads = ["rmse", "max", "at", "differing", "NaN or inf"];
        let [rmse, max, at, differing, not_finite] = heads;
        let _ = writeln!(text, "{:<12} {rmse:>12} {max:>12} {at:>14} {differing:>11} {not_finite:>12}", "channel");
        for c in self.channels.iter().chain([&self.total]) {
            let at = c.max_at.map_or("-".to_owned(), |[x, y]| format!("{x}, {y}"));
            let not_finite = format!("{} | {}", c.not_finite[0], c.not_finite[1]);
            let (rmse, max) = (number(c.rmse), number(c.max));
            let _ =
                writeln!(text, "{:<12} {rmse:>12} {max:>12} {at:>14} {:>11} {not_finite:>12}", c.channel, c.differing);
        }
        if let Some(flip) = self.flip {
            let _ = writeln!(text, "FLIP {flip:.6}");
        }
        text
    }
}

/// Six digits, however small or large.
fn number(value: f64) -> String {
    if value == 0.0 || (1e-3..1e6).contains(&value) { format!("{value:.6}") } else { format!("{value:.5e}") }
}
