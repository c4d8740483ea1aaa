//! `caribou stability`: each method driven to where it fails.

use std::fmt::Write;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use serde::Serialize;

use super::output;
use crate::atomic_file::{check_writable, write_atomically};
use crate::report::chart::{self, Chart, Format};
use crate::report::html::{Section, page};
use crate::stability::{Effort, Finding, STUDIES, Study};
use crate::{Error, Result};

/// Drive each method to where it fails, and show what this program uses instead
#[derive(Args)]
pub struct Stability {
    /// Folder for stability.html, stability.json, stability.csv and pictures; made if it does not exist
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Smaller samples: seconds instead of a minute or two
    #[arg(long)]
    quick: bool,
    /// Print nothing but errors
    #[arg(short = 'Q', long)]
    quiet: bool,
}

/// A study's picture, beside the page that holds the same as SVG.
fn picture(name: &str) -> String {
    format!("{}.png", name.replace(' ', "-"))
}

/// Schema `caribou-stability/1`.
#[derive(Serialize)]
struct Report {
    schema: &'static str,
    quick: bool,
    seconds: f64,
    rows: Vec<Finding>,
}

const HTML: &str = "stability.html";
const JSON: &str = "stability.json";
const CSV: &str = "stability.csv";

impl Stability {
    /// Measures, writes and prints.
    pub fn run(&self) -> Result<()> {
        std::fs::create_dir_all(&self.output).map_err(Error::io("create", &self.output))?;
        let pictures = STUDIES.map(|(name, _)| picture(name));
        let names = [HTML, JSON, CSV].into_iter().chain(pictures.iter().map(String::as_str));
        names.into_iter().try_for_each(|name| check_writable(&self.output.join(name)))?;
        let start = Instant::now();
        let effort = if self.quick { Effort::Quick } else { Effort::Full };
        let mut studies: Vec<(&str, Study)> = Vec::new();
        for (number, (name, drive)) in (1..).zip(STUDIES) {
            self.progress(&format!("{number}/{}  {name} ...", STUDIES.len()));
            let before = Instant::now();
            studies.push((name, drive(effort)?));
            self.progress(&format!(" {:.1} s\n", before.elapsed().as_secs_f64()));
        }
        let rows: Vec<Finding> = studies.iter().flat_map(|(_, study)| study.findings.clone()).collect();
        let charts: Vec<Chart> = studies.iter().flat_map(|(_, study)| study.charts.clone()).collect();
        write(&self.output.join(HTML), &html(&studies, &rows)?)?;
        Format::Csv.write(&self.output.join(CSV), &charts, 1)?;
        for (name, study) in &studies {
            Format::Png.write(&self.output.join(picture(name)), &study.charts, 2)?;
        }
        let table = table(&rows);
        let report =
            Report { schema: "caribou-stability/1", quick: self.quick, seconds: start.elapsed().as_secs_f64(), rows };
        output::write_json(&self.output.join(JSON), &report)?;
        if self.quiet {
            return Ok(());
        }
        output::print(&format!("{table}\nwritten  {}\n", self.output.join(HTML).display()))
    }

    /// On standard error, so that the table can be piped.
    fn progress(&self, text: &str) {
        if !self.quiet {
            let _ = write!(std::io::stderr(), "{text}");
        }
    }
}

fn write(path: &Path, text: &str) -> Result<()> {
    write_atomically(path, |file| file.write_all(text.as_bytes()).map_err(Error::io("write", path)))
}

const COLUMNS: [&str; 7] =
    ["method", "regime", "what was measured", "usual method", "usual", "this program", "what this program uses"];

fn cells(row: &Finding) -> [String; 7] {
    let number = |value: f64| if value == 0.0 { "0".to_owned() } else { format!("{value:.3e}") };
    [
        row.method.to_owned(),
        row.regime.clone(),
        row.measure.to_owned(),
        row.naive.to_owned(),
        number(row.naive_failure),
        number(row.failure),
        row.uses.to_owned(),
    ]
}

fn html(studies: &[(&str, Study)], rows: &[Finding]) -> Result<String> {
    let about = "Each method is driven to where the usual way of doing it fails, and so is what this program does instead. \
                 Everything runs on the CPU twin, whose results are those of every Vulkan device bit for bit. \
                 Made by: caribou stability";
    let mut sections = vec![
        Section::Paragraph(about.to_owned()),
        Section::Table(COLUMNS.map(str::to_owned).to_vec(), rows.iter().map(|row| cells(row).to_vec()).collect()),
    ];
    for (name, study) in studies {
        sections.push(Section::Heading((*name).to_owned()));
        sections.push(Section::Paragraph(study.about.to_owned()));
        sections.push(Section::Figure(chart::svg(&study.charts, 2)?));
    }
    Ok(page("Where methods fail", &sections))
}

/// Two lines a row: numbers, and what they are of.
fn table(rows: &[Finding]) -> String {
    let mut text =
        format!("{:<16} {:>10} {:>12}  {}\n", "method", "usual", "this program", "regime; what was measured");
    for row in rows {
        let [method, regime, measure, naive, failure, own, uses] = cells(row);
        let _ = writeln!(text, "{method:<16} {failure:>10} {own:>12}  {regime}; {measure}");
        let _ = writeln!(text, "{:<41}usual: {naive}", "");
        let _ = writeln!(text, "{:<41}here: {uses}", "");
    }
    text
}
