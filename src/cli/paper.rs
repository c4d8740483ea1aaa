//! `caribou paper`: the tables and figures of Zhu and Deng 2013.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::ArgPredicate;

use super::progress::Count;
use super::{output, tolerance};
use crate::atomic_file::write_atomically;
use crate::bvh::{Owners, Policy, Quality};
use crate::fermi::plan::Grouping;
use crate::fermi::result::{Accounting, Fidelity};
use crate::render::rays::{Batch, RayKind};
use crate::render::settings::Settings;
use crate::report::chart::Format;
use crate::report::experiment::{Migrate, Model};
use crate::report::paper::{self, Request};
use crate::{Error, Result};

/// Reproduce the tables and figures of Zhu and Deng 2013, and say what full accounting leaves of them
#[derive(Args)]
pub struct Paper {
    /// Folder with the four scenes: fairy or forest, conference, dragon, buddha in the file's name (.glb, .gltf);
    /// procedural scenes stand in for those that are not there
    #[arg(long, value_name = "DIR")]
    scenes: Option<PathBuf>,
    /// Folder for paper.html, paper.json, paper.csv and the charts
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Pixels across
    #[arg(long, default_value_t = paper::SIZE.0)]
    width: u32,
    /// Pixels down
    #[arg(long, default_value_t = paper::SIZE.1)]
    height: u32,
    /// Secondary rays; the paper does not say which
    #[arg(long, value_enum, default_value_t = paper::SECONDARY.kind)]
    secondary: RayKind,
    /// Secondary rays from each hit
    #[arg(long, value_name = "N", default_value_t = paper::SECONDARY.per_hit, value_parser = clap::value_parser!(u32).range(1..=256))]
    per_hit: u32,
    /// Sort secondary rays along a space-filling curve
    #[arg(long)]
    sort: bool,
    /// Where the tree is cut: level:K, bytes:N or sah:N
    #[arg(long, value_name = "POLICY", default_value_t = paper::PARTITION)]
    partition: Policy,
    /// Which rays run together in the paper's accounting
    #[arg(long, value_enum, default_value_t = Grouping::Queued)]
    grouping: Grouping,
    /// Machine of the model
    #[arg(long, default_value = "gpgpusim-3.2.2")]
    machine: String,
    /// Kernel of the standard traversal
    #[arg(long, default_value = "while-while")]
    kernel: String,
    /// How exactly time is modelled
    #[arg(long, value_enum, default_value_t = Fidelity::Cycles, default_value_if("tolerance", ArgPredicate::IsPresent, "sampled"))]
    fidelity: Fidelity,
    /// Predict runs of the standard traversal from samples within this part of themselves, e.g. 0.05, and those of
    /// migration as fidelity caches, which has no samples of them
    #[arg(long, value_name = "X", value_parser = tolerance::fraction, allow_negative_numbers = true)]
    tolerance: Option<f64>,
    /// Change a number of the machine or of a kernel, as in `caribou model`
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
    /// Time spent on the BVH: obvhs's build presets; from medium on large triangles are cut into pieces
    #[arg(long, value_enum, default_value_t)]
    bvh_quality: Quality,
    /// Leave out how results depend on what the paper leaves open
    #[arg(long)]
    no_sensitivity: bool,
    /// Print no table and no progress
    #[arg(short, long)]
    quiet: bool,
}

impl Paper {
    /// Predicts, writes and prints.
    pub fn run(&self) -> Result<()> {
        if self.secondary == RayKind::Primary {
            return Err(Error::usage("--secondary primary", "name ao, diffuse or reflect"));
        }
        Settings { width: self.width, height: self.height, ..Settings::default() }.check()?;
        let request = Request {
            scenes: self.scenes.clone(),
            size: (self.width, self.height),
            secondary: Batch { kind: self.secondary, per_hit: self.per_hit, sorted: self.sort },
            migrate: Migrate {
                partition: self.partition,
                owners: Owners::default(),
                accounting: Accounting::Paper,
                grouping: self.grouping,
            },
            model: Model::new(&self.machine, &self.kernel, &self.settings, self.fidelity)?,
            sampling: tolerance::request(self.fidelity, self.tolerance, None)?,
            quality: self.bvh_quality,
            sensitivity: !self.no_sensitivity,
        };
        std::fs::create_dir_all(&self.output).map_err(Error::io("create", &self.output))?;
        let count = Count::new("runs", self.quiet);
        let report = paper::measure(&request, &|done, total| count.counted(done, total))?;
        count.finish();
        let file = |name: &str| self.output.join(name);
        output::write_json(&file("paper.json"), &report)?;
        write_text(&file("paper.csv"), &paper::csv(&report))?;
        write_text(&file("paper.html"), &paper::page(&report)?)?;
        let charts = paper::charts(&report);
        for name in ["figures.svg", "figures.png", "figures.csv"] {
            let path = file(name);
            Format::of("-o", &path)?.write(&path, &charts, 2)?;
        }
        if self.quiet {
            return Ok(());
        }
        output::print(&format!("{}{}\n", paper::text(&report), file("paper.html").display()))
    }
}

fn write_text(path: &Path, text: &str) -> Result<()> {
    write_atomically(path, |file| file.write_all(text.as_bytes()).map_err(Error::io("write", path)))
}
