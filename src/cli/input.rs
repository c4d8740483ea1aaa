//! Arguments that several subcommands share: the scene, its BVH and the device.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;

use super::output;
use crate::Result;
use crate::bvh::{Bvh, Owners, Policy, Quality};
use crate::render::features::{Features, Indirect};
use crate::render::settings::Settings;
use crate::scene::tables::Tables;
use crate::scene::{self, Scene, builtin};
use crate::trace::MachineOptions;
use crate::vulkan::{Gpu, GpuOptions};

/// The scene and how its BVH is built.
#[derive(Args)]
pub struct SceneArguments {
    /// A .glb or .gltf file, or builtin:NAME (cornell, courtyard, gallery)
    #[arg(default_value_t = format!("{PREFIX}{}", builtin::DEFAULT))]
    scene: String,
    /// Camera of the scene by name or number; without any, one that frames the scene
    #[arg(long, value_name = "NAME|INDEX")]
    pub camera: Option<String>,
    /// Time spent on the BVH: obvhs's build presets; from medium on large triangles are cut into pieces
    #[arg(long, value_enum, default_value_t)]
    pub bvh_quality: Quality,
}

/// Which Vulkan device to use.
#[derive(Args)]
pub struct DeviceArguments {
    /// Vulkan device by number or part of its name (see `caribou info`)
    #[arg(long, value_name = "INDEX|NAME")]
    device: Option<String>,
    /// Use the CPU twin instead of Vulkan
    #[arg(long, conflicts_with_all = ["device", "validate"])]
    pub twin: bool,
    /// Run under Vulkan's validation layers; any message is a failure
    #[arg(long)]
    pub validate: bool,
    /// Use the files NAME.spv of a folder in place of the built-in kernels: for authors of kernels
    #[arg(long, value_name = "FOLDER", conflicts_with = "twin")]
    kernels: Option<PathBuf>,
}

/// Prefix of the names of built-in scenes.
const PREFIX: &str = "builtin:";

/// A scene with its BVH, and how long both took.
pub struct Prepared {
    /// The scene.
    pub scene: Scene,
    /// Its BVH.
    pub bvh: Bvh,
    /// Its materials and attributes as the kernels read them.
    pub tables: Tables,
    /// Seconds to load the scene.
    pub load_seconds: f64,
    /// Seconds to build the BVH.
    pub build_seconds: f64,
}

impl SceneArguments {
    /// A scene by name, all else by default.
    pub fn named(scene: &str) -> SceneArguments {
        SceneArguments { scene: scene.to_owned(), camera: None, bvh_quality: Quality::default() }
    }

    /// The scene as the user called it.
    pub fn name(&self) -> &str {
        &self.scene
    }

    /// Loads the scene.
    pub fn load(&self) -> Result<Scene> {
        match self.scene.strip_prefix(PREFIX) {
            Some(name) => scene::load_slice(&self.scene, builtin::builtin(name)?),
            None => scene::load(Path::new(&self.scene)),
        }
    }

    /// Loads the scene and builds its BVH.
    pub fn prepare(&self, quiet: bool) -> Result<Prepared> {
        let start = Instant::now();
        let scene = self.load()?;
        let load_seconds = start.elapsed().as_secs_f64();
        if !quiet {
            scene.report.warnings.iter().for_each(|warning| output::warn(warning));
        }
        let start = Instant::now();
        let bvh = Bvh::build(&scene.positions, self.bvh_quality)?;
        let build_seconds = start.elapsed().as_secs_f64();
        let tables = Tables::new(&scene);
        Ok(Prepared { scene, bvh, tables, load_seconds, build_seconds })
    }
}

impl DeviceArguments {
    /// Opens the device, or `None` for the twin.
    pub fn open(&self) -> Result<Option<Gpu>> {
        if self.twin {
            return Ok(None);
        }
        let options =
            GpuOptions { device: self.device.clone(), validate: self.validate, kernels: self.kernels.clone() };
        let gpu = Gpu::open(&options)?;
        if !gpu.probe().bit_identical() {
            output::warn("this driver rounds as it likes: hits may differ in their last bits from other devices");
        }
        if let Some(limit) = gpu.probe().loop_limit {
            tracing::info!("this driver silently ends loops after {limit} iterations; dispatches are kept below");
        }
        Ok(Some(gpu))
    }
}

/// Who owns the subtrees.
#[derive(Args, Clone, Copy)]
pub struct Ownership {
    /// How subtrees are given to SMs: neighbours together, or scattered
    #[arg(long, value_enum, default_value_t)]
    pub owners: Owners,
    /// Streaming multiprocessors, 1 to 1024
    #[arg(long, value_name = "N", default_value_t = MachineOptions::default().sms)]
    pub sms: u32,
}

/// The machine that strategies other than direct are laid out for.
#[derive(Args)]
pub struct MachineArguments {
    /// Where strategy migrate cuts the tree: level:K, bytes:N or sah:N, such as bytes:64KiB
    #[arg(long, value_name = "POLICY", default_value_t)]
    partition: Policy,
    #[command(flatten)]
    ownership: Ownership,
    /// Warps of 32 rays that an SM works on at a time
    #[arg(long, value_name = "N", default_value_t = MachineOptions::default().warps_per_sm)]
    warps_per_sm: u32,
    /// Take the SM's number from the hardware (VK_NV_shader_sm_builtins); --sms should then be its number of SMs
    #[arg(long)]
    hardware_sms: bool,
}

impl MachineArguments {
    /// As options.
    pub fn options(&self) -> MachineOptions {
        let MachineArguments { partition, ownership, warps_per_sm, hardware_sms } = *self;
        let Ownership { owners, sms } = ownership;
        MachineOptions { partition, owners, sms, warps_per_sm, hardware_sms }
    }
}

/// Light around the scene.
#[derive(Args)]
pub struct LightArguments {
    /// Indirect light at diffuse surfaces; by default diffuse where the scene has lights, else ao
    #[arg(long, value_enum)]
    indirect: Option<Indirect>,
    /// Length of ambient occlusion rays; by default a tenth of the scene's diagonal
    #[arg(long, value_name = "LENGTH", allow_negative_numbers = true)]
    ao_radius: Option<f32>,
}

impl LightArguments {
    /// The kernels' features for `scene`.
    pub fn features(&self, scene: &Scene) -> Features {
        Features::of(scene, self.indirect)
    }

    /// Length of ambient occlusion rays in `bvh`'s scene.
    pub fn ao_radius(&self, bvh: &Bvh) -> f32 {
        self.ao_radius.unwrap_or_else(|| Settings::default_ao_radius(bvh.bounds))
    }
}
