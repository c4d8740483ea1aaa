//! Charts as SVG.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::scale::Scale;
use super::{Chart, Point, Series, Style};

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = Result<(), Box<dyn std::error::Error>>;
type Place = (i32, i32);

/// Colours that differ for all common kinds of colour blindness (Okabe and Ito 2008), without the yellow, which is
/// too light for lines on white.
const PALETTE: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
];

const GRID: RGBColor = RGBColor(224, 224, 224);

/// Fronts, which have no markers of their own: their points are those of other series.
const FRONT: RGBColor = RGBColor(128, 128, 128);

/// Markers tell series apart without colour; points of a line are marked if there are at most so many.
const MOST_MARKED: usize = 40;

/// The font that PNG files are set in, and the common one with its metrics.
const FONT: &str = "DejaVu Sans, Verdana, sans-serif";
/// Size of text and of titles.
const TEXT: i32 = 12;
const TITLE: i32 = 14;
/// Lines of text are so far apart.
const LINE: i32 = 17;
/// Mean width of a character of the font, as a part of its size; wide enough for all but a few.
const CHARACTER: f64 = 0.62;

/// A chart's size, without title, legend and note.
const WIDTH: i32 = 600;
const PLOT_HEIGHT: i32 = 280;
/// Around the plot: the label of its vertical axis, beside which tick labels come; the right edge; ticks and label below.
const LEFT: i32 = 34;
const RIGHT: i32 = 24;
const BELOW: i32 = 48;
const GAP: i32 = 12;

/// A chart with its texts in lines.
struct Panel<'a> {
    chart: &'a Chart,
    title: Vec<String>,
    /// Entries of the legend: place relative to the legend's first line, and index of the series.
    legend: Vec<(Place, usize)>,
    note: Vec<String>,
}

impl Panel<'_> {
    fn new(chart: &Chart) -> Panel<'_> {
        let title = wrapped(&chart.title, TITLE, WIDTH - 2 * GAP);
        Panel { chart, title, legend: legend(&chart.series), note: wrapped(&chart.note, TEXT, WIDTH - 2 * GAP) }
    }

    /// Height of the title, the legend and the note.
    fn heights(&self) -> [i32; 3] {
        let legend = self.legend.last().map_or(0, |((_, y), _)| y + LINE);
        [self.title.len() as i32 * (LINE + 2), legend, self.note.len() as i32 * LINE]
    }
}

/// Charts side by side, `columns` a row.
pub fn svg(charts: &[Chart], columns: usize) -> Result<String, Box<dyn std::error::Error>> {
    let columns = columns.clamp(1, charts.len().max(1));
    let panels: Vec<Panel> = charts.iter().map(Panel::new).collect();
    // Within a row plots begin and end at the same height.
    let rows: Vec<(&[Panel], [i32; 3])> = panels
        .chunks(columns)
        .map(|row| {
            let most = |k: usize| row.iter().map(|panel| panel.heights()[k]).max().unwrap_or(0);
            (row, [most(0), most(1), most(2)])
        })
        .collect();
    let height = |heights: &[i32; 3]| heights.iter().sum::<i32>() + PLOT_HEIGHT + BELOW + 3 * GAP;
    let total: i32 = rows.iter().map(|(_, heights)| height(heights)).sum();
    let mut text = String::new();
    {
        let size = ((WIDTH * columns as i32) as u32, total.max(1) as u32);
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        root.fill(&WHITE)?;
        let mut top = 0;
        for (row, heights) in &rows {
            for (panel, left) in row.iter().zip((0..).step_by(WIDTH as usize)) {
                draw_panel(&root, panel, (left, top + GAP), heights[0])?;
            }
            top += height(heights);
        }
        root.present()?;
    }
    Ok(text)
}

fn draw_panel(root: &Area, panel: &Panel, (left, top): Place, title_height: i32) -> Drawn {
    for (line, y) in panel.title.iter().zip((top..).step_by((LINE + 2) as usize)) {
        let style = (FONT, em(TITLE)).into_font().style(FontStyle::Bold).color(&BLACK);
        root.draw(&Text::new(line.clone(), (left + GAP, y), style))?;
    }
    let plot = Plot::new(panel.chart, (left, top + title_height + GAP / 2));
    plot.axes(root, panel.chart)?;
    for (index, series) in panel.chart.series.iter().enumerate() {
        plot.series(root, series, index)?;
    }
    if panel.chart.series.iter().all(|series| series.points.is_empty()) {
        text(
            root,
            "no data",
            ((plot.left + plot.right) / 2, (plot.top + plot.bottom) / 2),
            HPos::Center,
            VPos::Center,
        )?;
    }
    let below = plot.bottom + BELOW;
    for &((x, y), index) in &panel.legend {
        let (x, y) = (left + GAP + x, below + y + LINE / 2);
        let series = &panel.chart.series[index];
        let sample: Vec<Place> = if series.style == Style::Points { vec![] } else { vec![(x, y), (x + 22, y)] };
        line(root, sample, color(series, index), 2)?;
        if is_marked(series) {
            marker(root, (x + 11, y), index)?;
        }
        text(root, &series.name, (x + 28, y), HPos::Left, VPos::Center)?;
    }
    let [_, legend_height, _] = panel.heights();
    for (note, y) in panel.note.iter().zip((below + legend_height + GAP / 2..).step_by(LINE as usize)) {
        text(root, note, (left + GAP, y), HPos::Left, VPos::Top)?;
    }
    Ok(())
}

/// Most numbers on an axis.
const X_TICKS: usize = 8;
const Y_TICKS: usize = 7;

/// The rectangle that data are drawn in, in pixels, and its axes.
struct Plot {
    /// Left edge of the chart.
    edge: i32,
    left: i32,
    right: i32,
    top: i32,
    bottom: i32,
    x: Scale,
    y: Scale,
}

impl Plot {
    fn new(chart: &Chart, (left, top): Place) -> Plot {
        let points = chart.series.iter().flat_map(|series| &series.points);
        let ends = |point: &Point| {
            [point.y, point.interval.map_or(point.y, |i| i[0]), point.interval.map_or(point.y, |i| i[1])]
        };
        let y = Scale::of(&chart.y, points.clone().flat_map(ends));
        let widest = y.ticks(Y_TICKS).iter().map(|tick| width(&tick.label, TEXT)).max().unwrap_or(0);
        Plot {
            edge: left,
            left: left + LEFT + widest,
            right: left + WIDTH - RIGHT,
            top,
            bottom: top + PLOT_HEIGHT,
            x: Scale::of(&chart.x, points.map(|point| point.x)),
            y,
        }
    }

    fn x(&self, at: f64) -> i32 {
        self.left + (at * f64::from(self.right - self.left)).round() as i32
    }

    fn y(&self, at: f64) -> i32 {
        self.bottom - (at * f64::from(self.bottom - self.top)).round() as i32
    }

    fn place(&self, x: f64, y: f64) -> Place {
        (self.x(self.x.at(x)), self.y(self.y.at(y)))
    }

    fn axes(&self, root: &Area, chart: &Chart) -> Drawn {
        for tick in self.x.ticks(X_TICKS) {
            let x = self.x(tick.at);
            line(root, vec![(x, self.top), (x, self.bottom)], GRID, 1)?;
            text(root, &tick.label, (x, self.bottom + 6), HPos::Center, VPos::Top)?;
        }
        for tick in self.y.ticks(Y_TICKS) {
            let y = self.y(tick.at);
            line(root, vec![(self.left, y), (self.right, y)], GRID, 1)?;
            text(root, &tick.label, (self.left - 6, y), HPos::Right, VPos::Center)?;
        }
        let corners = [(self.left, self.top), (self.left, self.bottom), (self.right, self.bottom)];
        line(root, corners.to_vec(), BLACK, 1)?;
        self.breaks(root)?;
        let middle = ((self.left + self.right) / 2, self.bottom + 6 + LINE);
        text(root, &chart.x.text(), middle, HPos::Center, VPos::Top)?;
        let style = (FONT, em(TEXT)).into_font().transform(FontTransform::Rotate270).color(&BLACK);
        let style = style.pos(Pos::new(HPos::Center, VPos::Top));
        root.draw(&Text::new(chart.y.text(), (self.edge + 6, (self.top + self.bottom) / 2), style))?;
        Ok(())
    }

    /// Two short strokes across an axis that leaps from zero to its first power of ten.
    fn breaks(&self, root: &Area) -> Drawn {
        for shift in [-2, 2] {
            if let Some(at) = self.x.zero_break() {
                let (x, y) = (self.x(at) + shift, self.bottom);
                line(root, vec![(x - 2, y + 5), (x + 2, y - 5)], BLACK, 1)?;
            }
            if let Some(at) = self.y.zero_break() {
                let (x, y) = (self.left, self.y(at) + shift);
                line(root, vec![(x - 5, y + 2), (x + 5, y - 2)], BLACK, 1)?;
            }
        }
        Ok(())
    }

    fn series(&self, root: &Area, series: &Series, index: usize) -> Drawn {
        let color = color(series, index);
        let mut points = series.points.clone();
        if series.style == Style::Front {
            points.sort_by(|a, b| a.x.total_cmp(&b.x));
        }
        for point in &points {
            let Some([low, high]) = point.interval else { continue };
            let ((x, low), (_, high)) = (self.place(point.x, low), self.place(point.x, high));
            line(root, vec![(x, low), (x, high)], color, 1)?;
            line(root, vec![(x - 4, low), (x + 4, low)], color, 1)?;
            line(root, vec![(x - 4, high), (x + 4, high)], color, 1)?;
        }
        let places: Vec<Place> = points.iter().map(|point| self.place(point.x, point.y)).collect();
        match series.style {
            Style::Line => line(root, places.clone(), color, 2)?,
            Style::Front => line(root, staircase(&places), color, 2)?,
            Style::Points => {}
        }
        if is_marked(series) {
            places.into_iter().try_for_each(|place| marker(root, place, index))?;
        }
        Ok(())
    }
}

/// From each place straight right to the next, then down.
fn staircase(places: &[Place]) -> Vec<Place> {
    let corner = |pair: &[Place]| [pair[0], (pair[1].0, pair[0].1)];
    places.windows(2).flat_map(corner).chain(places.last().copied()).collect()
}

fn is_marked(series: &Series) -> bool {
    match series.style {
        Style::Points => true,
        Style::Line => series.points.len() <= MOST_MARKED,
        Style::Front => false,
    }
}

fn color(series: &Series, index: usize) -> RGBColor {
    if series.style == Style::Front { FRONT } else { PALETTE[index % PALETTE.len()] }
}

/// Sizes of fonts are those of a box around the text in plotters.
fn em(size: i32) -> f64 {
    1.24 * f64::from(size)
}

fn width(text: &str, size: i32) -> i32 {
    (text.chars().count() as f64 * CHARACTER * f64::from(size)).ceil() as i32
}

fn text(root: &Area, text: &str, at: Place, h: HPos, v: VPos) -> Drawn {
    let style = (FONT, em(TEXT)).into_font().color(&BLACK).pos(Pos::new(h, v));
    root.draw(&Text::new(text.to_owned(), at, style))?;
    Ok(())
}

fn line(root: &Area, places: Vec<Place>, color: RGBColor, width: u32) -> Drawn {
    root.draw(&PathElement::new(places, color.stroke_width(width)))?;
    Ok(())
}

/// Each of the first four series has a shape of its own.
fn marker(root: &Area, (x, y): Place, index: usize) -> Drawn {
    let style = PALETTE[index % PALETTE.len()].filled();
    let corners: &[Place] = match index % 4 {
        0 => return Ok(root.draw(&Circle::new((x, y), 4, style))?),
        1 => &[(-4, -4), (4, -4), (4, 4), (-4, 4)],
        2 => &[(0, -5), (5, 4), (-5, 4)],
        _ => &[(0, -6), (5, 0), (0, 6), (-5, 0)],
    };
    let corners: Vec<Place> = corners.iter().map(|(dx, dy)| (x + dx, y + dy)).collect();
    root.draw(&Polygon::new(corners, style))?;
    Ok(())
}

/// Places of the legend's entries, as many a line as fit.
fn legend(series: &[Series]) -> Vec<(Place, usize)> {
    let mut place = (0, 0);
    let mut entries = Vec::new();
    for (index, one) in series.iter().enumerate() {
        let entry = 28 + width(&one.name, TEXT) + 14;
        if place.0 > 0 && place.0 + entry > WIDTH - 2 * GAP {
            place = (0, place.1 + LINE);
        }
        entries.push((place, index));
        place.0 += entry;
    }
    entries
}

/// Lines of a text that fit `most` pixels, broken between words.
fn wrapped(text: &str, size: i32, most: i32) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if width(line, size) + width(word, size) < most => *line += &format!(" {word}"),
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}
