//! Charts as files: which format a name asks for, pixels, and values.

use std::io::Write;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use resvg::{tiny_skia, usvg};

use super::Chart;
use crate::atomic_file::write_atomically;
use crate::{Error, Result};

/// Pixels of a PNG for each unit of length of the SVG, so that small text stays sharp.
const PIXELS: f32 = 2.0;

/// A format that charts are written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// A vector graphic.
    Svg,
    /// Pixels.
    Png,
    /// The values.
    Csv,
}

impl Format {
    /// What the name of `option`'s file asks for.
    ///
    /// # Errors
    /// [`Error::Usage`] if it ends in none of .svg, .png and .csv.
    pub fn of(option: &str, path: &Path) -> Result<Format> {
        match path.extension().map(|e| e.to_ascii_lowercase()) {
            Some(end) if end == "svg" => Ok(Format::Svg),
            Some(end) if end == "png" => Ok(Format::Png),
            Some(end) if end == "csv" => Ok(Format::Csv),
            _ => {
                Err(Error::usage(format!("{option} {}", path.display()), "name a file that ends in .svg, .png or .csv"))
            }
        }
    }

    /// Writes charts, `columns` a row, to a file.
    ///
    /// # Errors
    /// [`Error::Check`] for numbers that cannot be shown; [`Error::Io`] if the file cannot be written.
    pub fn write(self, path: &Path, charts: &[Chart], columns: usize) -> Result<()> {
        let bytes = match self {
            Format::Svg => super::svg(charts, columns)?.into_bytes(),
            Format::Png => super::png(charts, columns)?,
            Format::Csv => super::csv(charts)?.into_bytes(),
        };
        write_atomically(path, |file| file.write_all(&bytes).map_err(Error::io("write", path)))
    }
}

/// An SVG of this module as PNG. The font is part of the program, so that no picture depends on what is installed.
pub(super) fn png(svg: &str) -> Result<Vec<u8>> {
    let failed = |problem: String| Error::Check(format!("a chart as PNG: {problem}"));
    let options = usvg::Options { fontdb: fonts(), ..usvg::Options::default() };
    let tree = usvg::Tree::from_str(svg, &options).map_err(|error| failed(error.to_string()))?;
    let [width, height] = [tree.size().width(), tree.size().height()].map(|length| (PIXELS * length) as u32);
    let mut pixels =
        tiny_skia::Pixmap::new(width, height).ok_or_else(|| failed(format!("{width} x {height} pixels")))?;
    resvg::render(&tree, tiny_skia::Transform::from_scale(PIXELS, PIXELS), &mut pixels.as_mut());
    pixels.encode_png().map_err(|error| failed(error.to_string()))
}

fn fonts() -> Arc<usvg::fontdb::Database> {
    static FONTS: OnceLock<Arc<usvg::fontdb::Database>> = OnceLock::new();
    let load = || {
        let mut fonts = usvg::fontdb::Database::new();
        fonts.load_font_data(dejavu::sans::regular().to_vec());
        fonts.load_font_data(dejavu::sans::bold().to_vec());
        Arc::new(fonts)
    };
    FONTS.get_or_init(load).clone()
}

/// A line a value.
pub(super) fn csv(charts: &[Chart]) -> String {
    let mut text = "chart,series,x axis,x,y axis,y,low,high\n".to_owned();
    for chart in charts {
        for series in &chart.series {
            let names = [&chart.title, &series.name, &chart.x.text(), &chart.y.text()].map(|name| quoted(name));
            let [title, name, x_axis, y_axis] = &names;
            for point in &series.points {
                let [low, high] =
                    point.interval.map_or([String::new(), String::new()], |ends| ends.map(|v| v.to_string()));
                let (x, y) = (point.x, point.y);
                text += &format!("{title},{name},{x_axis},{x},{y_axis},{y},{low},{high}\n");
            }
        }
    }
    text
}

/// A field as in RFC 4180.
fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n', '\r']) {
        return format!("\"{}\"", field.replace('"', "\"\""));
    }
    field.to_owned()
}
