//! `caribou model`: what a described machine would do with the rays.

use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::ArgPredicate;

use super::input::{Prepared, SceneArguments};
use super::{output, tolerance};
use crate::atomic_file::check_writable;
use crate::bvh::{Owners, Policy};
use crate::fermi::plan::Grouping;
use crate::fermi::result::{Accounting, Fidelity, Prediction};
use crate::fermi::sampled::{self, Skipped};
use crate::render::features::Features;
use crate::render::rays::{Batch, Part, RayKind, twin_part};
use crate::render::settings::Settings;
use crate::report::chart::Format;
use crate::report::experiment::{self, Migrate, Recording, Traceable, Traversal};
use crate::report::search;
use crate::report::sweep::Sweep;
use crate::report::{model, reference};
use crate::trace::exchange::{Tree, read_rays, read_tree, record_reference};
use crate::trace::{Ray, Strategy};
use crate::{Error, Result, scene};

/// Predict cycles, cache misses and speed on a described machine
#[derive(Args)]
pub struct Model {
    #[command(flatten)]
    scene: SceneArguments,
    /// Instead of a scene: a tree written by another program
    #[arg(long, value_name = "FILE", requires = "ray_file", conflicts_with_all = ["scene", "reference"])]
    bvh: Option<PathBuf>,
    /// The rays to trace through it
    #[arg(long, value_name = "FILE", requires = "bvh")]
    ray_file: Option<PathBuf>,
    /// Instead of a scene: runs of a simulator, to be predicted and compared with
    #[arg(long, value_name = "FILE", requires = "cases", conflicts_with = "scene")]
    reference: Option<PathBuf>,
    /// Folder of the trees and rays that these runs traced
    #[arg(long, value_name = "DIR", requires = "reference")]
    cases: Option<PathBuf>,
    /// Pixels across
    #[arg(long, default_value_t = 256)]
    width: u32,
    /// Pixels down
    #[arg(long, default_value_t = 192)]
    height: u32,
    /// Kind of rays
    #[arg(long, value_enum, default_value_t = RayKind::Primary)]
    rays: RayKind,
    /// Rays from each hit of a camera ray, for all kinds but primary
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=256))]
    per_hit: u32,
    /// Sort the rays along a space-filling curve of origin and direction
    #[arg(long)]
    sort: bool,
    /// Only the rays from part K of N equal parts of the picture, as a benchmark launches them: with 32 rays a hit,
    /// a part in 24 of 1024 x 768 pixels is a million rays
    #[arg(long, value_name = "K/N", default_value = "1/1", allow_hyphen_values = true)]
    part: Part,
    /// Length of ambient occlusion rays; by default a tenth of the scene's diagonal
    #[arg(long, value_name = "LENGTH", allow_negative_numbers = true)]
    ao_radius: Option<f32>,
    /// gtx480, gtx560ti, gpgpusim-3.2.2, gpgpusim-4.2 or teslac2050
    #[arg(long, default_value = "gtx480")]
    machine: String,
    /// while-while or speculative-while-while
    #[arg(long, default_value = "while-while")]
    kernel: String,
    /// Who traces which ray when
    #[arg(long, value_enum, default_value_t)]
    strategy: Strategy,
    /// Where strategy migrate cuts the tree: level:K, bytes:N or sah:N, such as bytes:64KiB
    #[arg(long, value_name = "POLICY", default_value_t)]
    partition: Policy,
    /// How it gives subtrees to SMs: neighbours together, or scattered
    #[arg(long, value_enum, default_value_t)]
    owners: Owners,
    /// What it is charged for: as in the paper (a virtual L1 a subtree, queues free), or everything
    #[arg(long, value_enum, default_value_t)]
    accounting: Accounting,
    /// Which rays run together in the paper's accounting, which leaves it open
    #[arg(long, value_enum, default_value_t)]
    grouping: Grouping,
    /// How exactly time is modelled
    #[arg(long, value_enum, default_value_t = Fidelity::Cycles, default_value_if("tolerance", ArgPredicate::IsPresent, "sampled"))]
    fidelity: Fidelity,
    /// Replay no more than cycles within this part of themselves need, e.g. 0.02: leave out caches that hold all that the
    /// rays touch, and sample warps until the 95 % interval is as narrow
    #[arg(long, value_name = "X", value_parser = tolerance::fraction, allow_negative_numbers = true)]
    tolerance: Option<f64>,
    /// With a tolerance: give the best answer after this time
    #[arg(long, value_name = "SECONDS", requires = "tolerance", value_parser = tolerance::seconds, allow_negative_numbers = true)]
    time_limit: Option<f64>,
    /// Change a number of the machine, e.g. sms=8 or l1.kib=48, or of a kernel, e.g. kernel.registers=32;
    /// those of strategy migrate are schedule, subtree and queue
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
    /// Predict at each value of a number: KEY=FIRST..LAST, KEY=FIRST..LAST:STEP or KEY=A,B,C, keys as of --set
    #[arg(long, value_name = "KEY=RANGE", conflicts_with = "reference")]
    sweep: Option<Sweep>,
    /// Look for the setting of strategy migrate with the fewest cycles when everything is charged, and say what would
    /// have to change for it to win
    #[arg(long, conflicts_with_all = ["reference", "sweep"])]
    search: bool,
    /// The curves of a sweep or search as .svg, .png or .csv; may be given more than once
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,
    /// Also write the result to a file, or to standard output with -
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Print no table
    #[arg(short, long)]
    quiet: bool,
}

impl Model {
    /// Predicts and prints.
    pub fn run(&self) -> Result<()> {
        if !self.output.is_empty() && self.sweep.is_none() && !self.search {
            return Err(Error::usage("-o without curves", "give --sweep or --search, or --json for the prediction"));
        }
        for path in self.json.iter().filter(|path| path.as_os_str() != "-").chain(&self.output) {
            check_writable(path)?;
        }
        self.output.iter().try_for_each(|path| Format::of("-o", path).map(drop))?;
        match (&self.reference, &self.cases) {
            (Some(reference), Some(cases)) => {
                let runs = reference::read_runs(reference)?;
                let rows = reference::compare(&runs, cases, self.fidelity, &self.settings)?;
                self.show(&rows, || reference::table(&rows))
            }
            _ => {
                if let Some(request) = tolerance::request(self.fidelity, self.tolerance, self.time_limit)? {
                    return self.sample(&request);
                }
                let recording = self.record()?;
                match &self.sweep {
                    Some(sweep) => self.sweep(sweep, &recording),
                    None if self.search => self.search(&recording),
                    None => {
                        let prediction = self.predict(&recording, &self.settings)?;
                        self.show(&prediction, || model::table(&prediction))
                    }
                }
            }
        }
    }

    fn sweep(&self, sweep: &Sweep, recording: &Recording) -> Result<()> {
        let steps = sweep.run(|setting| {
            let settings = [&self.settings[..], &[setting]].concat();
            self.predict(recording, &settings)
        })?;
        let charts = sweep.charts(&steps);
        for path in &self.output {
            Format::of("-o", path)?.write(path, &charts, 2)?;
        }
        self.show(&steps, || sweep.table(&steps))
    }

    fn search(&self, recording: &Recording) -> Result<()> {
        let model = |more: &[String]| {
            let settings = [&self.settings[..], more].concat();
            experiment::Model::new(&self.machine, &self.kernel, &settings, self.fidelity)
        };
        let found = search::search(&model, recording)?;
        let charts = search::charts(&found);
        for path in &self.output {
            Format::of("-o", path)?.write(path, &charts, 2)?;
        }
        self.show(&found, || search::table(&found))
    }

    fn predict(&self, recording: &Recording, settings: &[String]) -> Result<Prediction> {
        let model = experiment::Model::new(&self.machine, &self.kernel, settings, self.fidelity)?;
        model.predict(recording, self.strategy, &self.migrate())
    }

    fn migrate(&self) -> Migrate {
        let Model { partition, owners, accounting, grouping, .. } = *self;
        Migrate { partition, owners, accounting, grouping }
    }

    fn show(&self, value: &impl serde::Serialize, table: impl Fn() -> String) -> Result<()> {
        if let Some(path) = &self.json {
            output::write_json(path, value)?;
        }
        if self.quiet || self.json.as_ref().is_some_and(|path| path.as_os_str() == "-") {
            return Ok(());
        }
        output::print(&table())
    }

    /// Predicts from the replay of as few rays as the tolerance allows.
    fn sample(&self, request: &sampled::Request) -> Result<()> {
        let model = experiment::Model::new(&self.machine, &self.kernel, &self.settings, self.fidelity)?;
        if self.strategy != Strategy::Direct || self.sweep.is_some() || self.search {
            return Err(Error::usage("--fidelity sampled", "it samples rays under strategy direct"));
        }
        let prediction = match (&self.bvh, &self.ray_file) {
            (Some(bvh), Some(rays)) => {
                let (tree, rays) = (self.tree(bvh)?, read_rays(rays)?);
                let traversal = Traversal::Exchanged(&tree);
                model.sampled(&Traceable { traversal, children: &tree.children, rays: &rays }, request)?
            }
            _ => self.sample_scene(&model, request)?,
        };
        self.show(&prediction, || model::table(&prediction))?;
        tolerance::check(prediction.tolerance.as_ref())
    }

    fn sample_scene(&self, model: &experiment::Model, request: &sampled::Request) -> Result<Prediction> {
        let (prepared, rays) = self.rays()?;
        let children: Vec<[u32; 2]> = prepared.bvh.nodes.iter().map(|node| node.child).collect();
        let traversal = Traversal::Scene(&prepared.bvh, self.rays.query());
        let traceable = Traceable { traversal, children: &children, rays: &rays };
        let features = Features::of(&prepared.scene, None);
        if self.rays == RayKind::Reflect && !features.mirrors && !features.glass {
            let (what, why) = ("pass of reflected rays", "no material reflects or refracts, so a picture has none");
            return model.left_out(&traceable, request, Skipped { what, why: why.to_owned() });
        }
        model.sampled(&traceable, request)
    }

    fn record(&self) -> Result<Recording> {
        // What cannot be predicted is refused before anything is traced.
        let model = experiment::Model::new(&self.machine, &self.kernel, &self.settings, self.fidelity)?;
        if let (Some(bvh), Some(rays)) = (&self.bvh, &self.ray_file) {
            let tree = self.tree(bvh)?;
            let (_, trace) = record_reference(&tree, &read_rays(rays)?);
            let (nodes, bounds) = if self.cuts() { tree.nodes() } else { Default::default() };
            return Ok(Recording { trace, children: tree.children, triangles: tree.triangles.len(), nodes, bounds });
        }
        let (prepared, rays) = self.rays()?;
        let children: Vec<[u32; 2]> = prepared.bvh.nodes.iter().map(|node| node.child).collect();
        let traversal = Traversal::Scene(&prepared.bvh, self.rays.query());
        let trace = Traceable { traversal, children: &children, rays: &rays }.record(model.loops(self.cuts()));
        let (triangles, bounds) = (prepared.bvh.references(), prepared.bvh.bounds);
        Ok(Recording { trace, children, triangles, nodes: prepared.bvh.nodes, bounds })
    }

    /// Whether the tree is to be cut into subtrees.
    fn cuts(&self) -> bool {
        self.strategy == Strategy::Migrate || self.search
    }

    fn tree(&self, path: &Path) -> Result<Tree> {
        let tree = read_tree(path)?;
        if self.cuts() {
            tree.check_leaves().map_err(|(node, problem)| {
                let remedy =
                    "subtrees need leaves of triangles of their own: write such a tree, or take another strategy";
                Error::input(path, format!("node {node}"), problem, remedy)
            })?;
        }
        Ok(tree)
    }

    fn rays(&self) -> Result<(Prepared, Vec<Ray>)> {
        let prepared = self.scene.prepare(self.quiet)?;
        let camera = scene::select_camera(&prepared.scene, self.scene.camera.as_deref())?;
        let settings = Settings {
            width: self.width,
            height: self.height,
            ao_radius: self.ao_radius.unwrap_or_else(|| Settings::default_ao_radius(prepared.bvh.bounds)),
            ..Settings::default()
        };
        settings.check()?;
        let batch = Batch { kind: self.rays, per_hit: self.per_hit, sorted: self.sort };
        let rays = twin_part(&prepared.bvh, &prepared.tables, &settings.frame(&camera), batch, self.part);
        if rays.is_empty() {
            return Err(Error::usage("no rays", "the camera sees nothing: choose another, or primary rays"));
        }
        Ok((prepared, rays))
    }
}
