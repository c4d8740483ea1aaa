//! Charts: plain data in; SVG, PNG and CSV out. All charts of the program are drawn here.

mod draw;
mod export;
mod front;
mod scale;

#[cfg(test)]
mod tests;

pub use export::Format;
pub use front::front;

use crate::{Error, Result};

/// An axis and what its numbers are.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// What is shown.
    pub label: String,
    /// Its unit; empty for a plain number.
    pub unit: String,
    /// Logarithmic. Zero is then shown apart, below a break of the axis; negative numbers are refused.
    pub log: bool,
}

impl Axis {
    /// A linear axis.
    pub fn linear(label: &str, unit: &str) -> Axis {
        Axis { label: label.to_owned(), unit: unit.to_owned(), log: false }
    }

    /// A logarithmic axis.
    pub fn log(label: &str, unit: &str) -> Axis {
        Axis { log: true, ..Axis::linear(label, unit) }
    }

    /// Label and unit.
    fn text(&self) -> String {
        if self.unit.is_empty() { self.label.clone() } else { format!("{} ({})", self.label, self.unit) }
    }
}

/// One measured value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Where.
    pub x: f64,
    /// The value.
    pub y: f64,
    /// Low and high end of its interval, drawn as an error bar.
    pub interval: Option<[f64; 2]>,
}

impl From<(f64, f64)> for Point {
    fn from((x, y): (f64, f64)) -> Point {
        Point { x, y, interval: None }
    }
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Points in their order, joined; few are marked too.
    Line,
    /// Markers alone.
    Points,
    /// A Pareto front, see [`front`]: steps from point to point, along which nothing better was found.
    Front,
}

/// Values that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// How it is drawn.
    pub style: Style,
    /// The values.
    pub points: Vec<Point>,
}

impl Series {
    /// A series of values without intervals.
    pub fn new(name: impl Into<String>, style: Style, points: impl IntoIterator<Item = (f64, f64)>) -> Series {
        Series { name: name.into(), style, points: points.into_iter().map(Point::from).collect() }
    }
}

/// One chart.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chart {
    /// What the chart shows.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// What is drawn, in the order of the legend.
    pub series: Vec<Series>,
    /// Conditions of the measurement, written below; may be empty.
    pub note: String,
}

impl Chart {
    /// As one picture.
    ///
    /// # Errors
    /// [`Error::Check`] for numbers that cannot be shown.
    pub fn svg(&self) -> Result<String> {
        svg(std::slice::from_ref(self), 1)
    }

    /// Refuses numbers that no place on the axes stands for.
    fn check(&self) -> Result<()> {
        for series in &self.series {
            for point in &series.points {
                let [low, high] = point.interval.unwrap_or([point.y, point.y]);
                let all = [point.x, point.y, low, high];
                let shown = |axis: &Axis, v: f64| v.is_finite() && !(axis.log && v < 0.0);
                if !shown(&self.x, point.x) || all[1..].iter().any(|&v| !shown(&self.y, v)) || low > high {
                    let problem = format!("x, y and interval {all:?} cannot be shown");
                    return Err(Error::Check(format!("chart '{}', series '{}': {problem}", self.title, series.name)));
                }
            }
        }
        Ok(())
    }
}

/// Charts side by side in one picture, `columns` a row.
///
/// # Errors
/// [`Error::Check`] for numbers that cannot be shown.
pub fn svg(charts: &[Chart], columns: usize) -> Result<String> {
    charts.iter().try_for_each(Chart::check)?;
    draw::svg(charts, columns).map_err(|error| Error::Check(format!("drawing a chart: {error}")))
}

/// The same as [`svg`], as the bytes of a PNG file with two pixels for each unit of length.
///
/// # Errors
/// As [`svg`].
pub fn png(charts: &[Chart], columns: usize) -> Result<Vec<u8>> {
    export::png(&svg(charts, columns)?)
}

/// All values as comma-separated text: a line a value. `x` and `y` are named by the axes of its chart.
///
/// # Errors
/// As [`svg`].
pub fn csv(charts: &[Chart]) -> Result<String> {
    charts.iter().try_for_each(Chart::check)?;
    Ok(export::csv(charts))
}
