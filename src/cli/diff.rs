//! `caribou diff`: how far two pictures are apart.

use std::path::{Path, PathBuf};

use clap::Args;

use super::memory::check_fits;
use super::output;
use crate::atomic_file::check_writable;
use crate::render::compare::check_comparable;
use crate::render::compare::picture::{Metric, difference_image, false_colors};
use crate::render::exr::read::{extent, read};
use crate::render::exr::write_plain;
use crate::render::image::Image;
use crate::render::png;
use crate::report::diff::Report;
use crate::{Error, Result};

/// Bytes a pixel that FLIP needs at its peak: both pictures as the eye sees them and planes in between, in doubles.
const FLIP_BYTES: u64 = 224;

/// Compare two OpenEXR files, channel by channel and in total
#[derive(Args)]
pub struct Diff {
    /// The first file: the reference
    a: PathBuf,
    /// The second file
    b: PathBuf,
    /// What the total, the limit and the difference picture go by
    #[arg(long, value_enum, default_value_t)]
    metric: Metric,
    /// Compare these channels alone, separated by commas; by default all
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    channels: Vec<String>,
    /// Exit with 1 if the total exceeds this, or if a sample is NaN or infinite
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    fail_above: Option<f64>,
    /// Write the differences: .png in false colours, .exr channel by channel
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Also write the result (schema caribou-diff/1) to a file, or to standard output with -
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Print no table
    #[arg(short, long)]
    quiet: bool,
}

/// Kinds of difference pictures.
#[derive(Clone, Copy)]
enum Format {
    Png,
    Exr,
}

impl Diff {
    /// Compares, reports, and fails above the limit.
    pub fn run(&self) -> Result<()> {
        let format = self.check()?;
        let (a, b) = self.read()?;
        let files = [&self.a, &self.b].map(|path| path.display().to_string());
        let report = Report::new(files, (&a, &b), self.metric)
            .ok_or_else(|| Error::usage("--metric flip", "it needs channels R, G and B; choose rmse or max"))?;
        if let Some(path) = &self.json {
            output::write_json(path, &report)?;
        }
        let silent = self.quiet || self.json.as_ref().is_some_and(|path| path.as_os_str() == "-");
        if !silent {
            output::print(&report.table())?;
        }
        if let (Some(path), Some(format)) = (&self.output, format) {
            self.write(path, format, (&a, &b), silent)?;
        }
        self.judge(&report)
    }

    /// Refuses what cannot be done before any work.
    fn check(&self) -> Result<Option<Format>> {
        if let Some(limit) = self.fail_above.filter(|limit| !limit.is_finite() || *limit < 0.0) {
            return Err(Error::usage(format!("--fail-above {limit}"), "it must be a number from 0 up"));
        }
        for path in self.output.iter().chain(self.json.iter().filter(|path| path.as_os_str() != "-")) {
            check_writable(path)?;
        }
        self.output.as_deref().map(format_of).transpose()
    }

    fn read(&self) -> Result<(Image, Image)> {
        let pixels = |path: &Path| {
            let extent = extent(path)?;
            Ok::<_, Error>((extent.width as u64 * extent.height as u64, extent.channels as u64))
        };
        let ((first, channels), (second, more)) = (pixels(&self.a)?, pixels(&self.b)?);
        // Samples are decoded and then held as floats.
        let bytes = first * (8 * channels + FLIP_BYTES) + second * 8 * more;
        check_fits("comparing these pictures", bytes, "compare smaller pictures")?;
        let (a, b) = (self.chosen(&self.a)?, self.chosen(&self.b)?);
        check_comparable(&a, &b)?;
        Ok((a, b))
    }

    /// The channels asked for of a file.
    fn chosen(&self, path: &Path) -> Result<Image> {
        let image = read(path)?;
        if self.channels.is_empty() {
            return Ok(image);
        }
        let mut chosen = Image::new(image.width(), image.height())?;
        for name in &self.channels {
            let Some(samples) = image.channel(name) else {
                let known = image.channels().iter().map(|channel| channel.name.as_str()).collect::<Vec<_>>().join(", ");
                return Err(Error::input(path, format!("channel {name}"), "there is none", format!("it has {known}")));
            };
            let twice = |_| Error::usage(format!("--channels names {name} twice"), "name each channel once");
            chosen.push(name, samples.clone()).map_err(twice)?;
        }
        Ok(chosen)
    }

    fn write(&self, path: &Path, format: Format, (a, b): (&Image, &Image), silent: bool) -> Result<()> {
        let scale = match format {
            Format::Exr => {
                let texts = [("first", self.a.display().to_string()), ("second", self.b.display().to_string())];
                write_plain(
                    path,
                    difference_image(a, b)?,
                    &texts.each_ref().map(|(name, text)| (*name, text.as_str())),
                )?;
                String::new()
            }
            Format::Png => {
                // Report::new has refused FLIP without colours.
                let differences = self.metric.of_pixels(a, b).unwrap_or_default();
                let (pixels, range) = false_colors(self.metric, &differences);
                png::write_pixels(path, (a.width(), a.height()), &pixels)?;
                format!(", {} from {} to {}", self.metric.name(), range.min, range.max)
            }
        };
        if silent { Ok(()) } else { output::print(&format!("written {}{scale}\n", path.display())) }
    }

    fn judge(&self, report: &Report) -> Result<()> {
        let Some(limit) = self.fail_above else { return Ok(()) };
        if report.not_finite() > 0 {
            let [a, b] = report.total.not_finite;
            return Err(Error::Check(format!(
                "{a} samples of the first picture and {b} of the second are NaN or infinite"
            )));
        }
        match report.value > limit {
            true => Err(Error::Check(format!("{} {} is above {limit}", self.metric.name(), report.value))),
            false => Ok(()),
        }
    }
}

fn format_of(path: &Path) -> Result<Format> {
    match path.extension().map(|extension| extension.to_ascii_lowercase()) {
        Some(extension) if extension == "png" => Ok(Format::Png),
        Some(extension) if extension == "exr" => Ok(Format::Exr),
        _ => Err(Error::usage(format!("-o {}", path.display()), "a difference picture is .png or .exr")),
    }
}
