//! `caribou study`: speed against accuracy.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;

use super::input::{DeviceArguments, Prepared, SceneArguments};
use super::progress::Count;
use super::{output, tolerance};
use crate::atomic_file::{check_writable, write_atomically};
use crate::render::settings::Settings;
use crate::report::chart::Format;
use crate::report::study::{self, Progress, Request, Simulator, Subject, TOPICS, charts};
use crate::scene::builtin::BUILTINS;
use crate::{Error, Result};

/// Measure and chart speed against accuracy of models, pictures and traversal, and how cost grows with work
#[derive(Args)]
pub struct Study {
    /// .glb or .gltf files, or builtin:NAME; by default all built-in scenes
    #[arg(value_name = "SCENE")]
    scenes: Vec<String>,
    /// Folder for study.html, study.json, and the charts as .svg, .png and .csv
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Pixels across
    #[arg(long, default_value_t = 256)]
    width: u32,
    /// Pixels down
    #[arg(long, default_value_t = 192)]
    height: u32,
    /// Machine of the models, as in `caribou model`
    #[arg(long, default_value = "gtx480")]
    machine: String,
    /// Also compare the models with runs of a simulator
    #[arg(long, value_name = "FILE", requires = "cases")]
    reference: Option<PathBuf>,
    /// Folder of the trees and rays that these runs traced
    #[arg(long, value_name = "DIR", requires = "reference")]
    cases: Option<PathBuf>,
    /// Few samples and small scenes: to see that all works
    #[arg(long, conflicts_with = "full")]
    quick: bool,
    /// No time limit, and scenes of up to 10,000,000 triangles instead of 1,000,000
    #[arg(long)]
    full: bool,
    /// Leave out the dearest measurements that would not end in this time: pictures of many samples, cycles of large
    /// scenes. What every chart needs is measured even so
    #[arg(long, value_name = "SECONDS", default_value_t = 600.0, conflicts_with = "full", value_parser = tolerance::seconds, allow_negative_numbers = true)]
    time_limit: f64,
    /// Predict cycles that only show how cost grows from samples within this part of themselves, e.g. 0.1, and chart
    /// that tolerance beside the others
    #[arg(long, value_name = "X", value_parser = tolerance::fraction, allow_negative_numbers = true)]
    tolerance: Option<f64>,
    #[command(flatten)]
    device: DeviceArguments,
    /// Print no table and no progress
    #[arg(short, long)]
    quiet: bool,
}

impl Study {
    /// Measures, writes and prints.
    pub fn run(&self) -> Result<()> {
        let request = self.request()?;
        let subjects = self.subjects()?;
        let gpu = self.device.open()?;
        let count = Count::new("parts", self.quiet);
        let report = study::measure(&request, gpu.as_ref(), &subjects, &|progress| match progress {
            Progress::Begins(name) => count.doing(name),
            Progress::Ended { part, done, of } => {
                count.update(done, of);
                count.line(&format!("{:>7.1} s  {}", part.seconds, part.name));
            }
        })?;
        count.finish();
        if let Some(message) = gpu.iter().flat_map(|gpu| gpu.validation_messages()).next() {
            return Err(Error::Check(format!("validation: {message}")));
        }
        self.write(&report)?;
        if self.quiet {
            return Ok(());
        }
        output::print(&format!("{}{}\n", study::text(&report), self.output.join("study.html").display()))
    }

    /// Refuses what cannot be done before any work.
    fn request(&self) -> Result<Request> {
        Settings { width: self.width, height: self.height, ..Settings::default() }.check()?;
        let simulator = self.reference.as_ref().zip(self.cases.as_ref());
        let request = Request {
            size: (self.width, self.height),
            machine: self.machine.clone(),
            simulator: simulator.map(|(file, cases)| Simulator::read(file, cases)).transpose()?,
            quick: self.quick,
            full: self.full,
            time_limit: (!self.full).then_some(self.time_limit),
            tolerance: self.tolerance,
        };
        request.check()?;
        std::fs::create_dir_all(&self.output).map_err(Error::io("create", &self.output))?;
        self.files().iter().try_for_each(|path| check_writable(path))?;
        Ok(request)
    }

    fn subjects(&self) -> Result<Vec<Subject>> {
        let builtin = || BUILTINS.iter().map(|builtin| format!("builtin:{}", builtin.name)).collect();
        let names: Vec<String> = if self.scenes.is_empty() { builtin() } else { self.scenes.clone() };
        let subject = |name: &String| {
            let Prepared { scene, bvh, .. } = SceneArguments::named(name).prepare(self.quiet)?;
            Subject::new(name, scene, bvh)
        };
        names.iter().map(subject).collect()
    }

    /// All that is written: the report, the page, and charts.
    fn files(&self) -> Vec<PathBuf> {
        let charts = TOPICS.iter().flat_map(|topic| ENDINGS.map(|ending| format!("{}.{ending}", topic.name())));
        ["study.json", "study.html"].map(str::to_owned).into_iter().chain(charts).map(|n| self.output.join(n)).collect()
    }

    fn write(&self, report: &study::Report) -> Result<()> {
        output::write_json(&self.output.join("study.json"), report)?;
        let (path, page) = (self.output.join("study.html"), study::page(report)?);
        write_atomically(&path, |file| file.write_all(page.as_bytes()).map_err(Error::io("write", &path)))?;
        for topic in TOPICS {
            let charts = charts(report, topic);
            for ending in ENDINGS {
                let path = self.output.join(format!("{}.{ending}", topic.name()));
                Format::of("-o", &path)?.write(&path, &charts, study::COLUMNS)?;
            }
        }
        Ok(())
    }
}

/// Formats of charts.
const ENDINGS: [&str; 3] = ["svg", "png", "csv"];
