//! `caribou model`: what a described machine would do with the rays.

use std::path::PathBuf;

use clap::Args;

use super::input::SceneArguments;
use super::output;
use crate::atomic_file::check_writable;
use crate::fermi::kernel::Kernel;
use crate::fermi::machine::Machine;
use crate::fermi::result::{Fidelity, Prediction};
use crate::fermi::{self, simt::Workload};
use crate::render::rays::{RayKind, twin_rays};
use crate::render::settings::Settings;
use crate::report::{model, reference};
use crate::trace::exchange::{read_rays, read_tree, record_reference};
use crate::trace::steps::record_steps;
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
    /// Length of ambient occlusion rays; by default a tenth of the scene's diagonal
    #[arg(long, value_name = "LENGTH", allow_negative_numbers = true)]
    ao_radius: Option<f32>,
    /// gtx480, gtx560ti, gpgpusim-3.2.2, gpgpusim-4.2 or teslac2050
    #[arg(long, default_value = "gtx480")]
    machine: String,
    /// while-while or speculative-while-while
    #[arg(long, default_value = "while-while")]
    kernel: String,
    /// How exactly time is modelled
    #[arg(long, value_enum, default_value_t = Fidelity::Cycles)]
    fidelity: Fidelity,
    /// Change a number of the machine, e.g. sms=8 or l1.kib=48, or of the kernel, e.g. kernel.registers=32
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
    /// Also write the result to a file, or to standard output with -
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Print no table
    #[arg(short, long)]
    quiet: bool,
}

/// Prefix of settings of the kernel.
const KERNEL_SETTING: &str = "kernel.";

impl Model {
    /// Predicts and prints.
    pub fn run(&self) -> Result<()> {
        if let Some(path) = self.json.as_ref().filter(|path| path.as_os_str() != "-") {
            check_writable(path)?;
        }
        match (&self.reference, &self.cases) {
            (Some(reference), Some(cases)) => {
                let runs = reference::read_runs(reference)?;
                let rows = reference::compare(&runs, cases, self.fidelity, &self.settings)?;
                self.show(&rows, || reference::table(&rows))
            }
            _ => {
                let prediction = self.predict()?;
                self.show(&prediction, || model::table(&prediction))
            }
        }
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

    fn predict(&self) -> Result<Prediction> {
        let (of_kernel, of_machine): (Vec<String>, Vec<String>) =
            self.settings.iter().cloned().partition(|setting| setting.starts_with(KERNEL_SETTING));
        let of_kernel: Vec<String> = of_kernel.iter().map(|s| s[KERNEL_SETTING.len()..].to_owned()).collect();
        let machine = Machine::named(&self.machine, &of_machine)?;
        let kernel = Kernel::named(&self.kernel, &of_kernel)?;
        let run = |workload: &Workload| fermi::predict(&machine, &kernel, workload, self.fidelity);
        if let (Some(bvh), Some(rays)) = (&self.bvh, &self.ray_file) {
            let tree = read_tree(bvh)?;
            let (_, trace) = record_reference(&tree, &read_rays(rays)?);
            return run(&Workload { trace: &trace, children: &tree.children, triangles: tree.triangles.len() });
        }
        let prepared = self.scene.prepare(self.quiet)?;
        let camera = scene::select_camera(&prepared.scene, self.scene.camera.as_deref())?;
        let settings = Settings {
            width: self.width,
            height: self.height,
            spp: 1,
            max_depth: 0,
            seed: 1,
            ao_radius: self.ao_radius.unwrap_or_else(|| Settings::default_ao_radius(prepared.bvh.bounds)),
            sky: 1.0,
            transparent: false,
        };
        settings.check()?;
        let rays = twin_rays(&prepared.bvh, &prepared.tables, &settings.frame(&camera), self.rays);
        if rays.is_empty() {
            return Err(Error::usage("no rays", "the camera sees nothing: choose another, or primary rays"));
        }
        let (_, trace) = record_steps(&prepared.bvh, &rays, self.rays.query());
        let children: Vec<[u32; 2]> = prepared.bvh.nodes.iter().map(|node| node.child).collect();
        run(&Workload { trace: &trace, children: &children, triangles: prepared.bvh.triangle_count })
    }
}
