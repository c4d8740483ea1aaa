//! `caribou render`: a scene becomes an EXR file.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Instant;

use clap::Args;

use super::input::{DeviceArguments, LightArguments, MachineArguments, Prepared, SceneArguments};
use super::memory::check_picture;
use super::output;
use super::progress::Bar;
use crate::atomic_file::check_writable;
use crate::render::aov::Aov;
use crate::render::camera_matrices::camera_matrices;
use crate::render::exr::{self, Metadata};
use crate::render::features::Features;
use crate::render::image::{Depth, Image};
use crate::render::picture::{Picture, Request, picture};
use crate::render::png::{self, Preview};
use crate::render::settings::{DEFAULT_MOST_SPP, MAX_SPP, Settings};
use crate::report::head::Head;
use crate::report::machine::Machine;
use crate::report::render::{Report, named};
use crate::report::scene::SceneSummary;
use crate::report::tracing::Tracing;
use crate::scene::{Camera, select_camera};
use crate::trace::{NodeFormat, Strategy, TracerOptions};
use crate::vulkan::Gpu;
use crate::{Error, Result};

/// Render a scene to an OpenEXR file
#[derive(Args)]
pub struct Render {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    device: DeviceArguments,
    #[command(flatten)]
    light: LightArguments,
    /// How rays are scheduled; the picture is the same with all
    #[arg(long, value_enum, default_value_t)]
    strategy: Strategy,
    #[command(flatten)]
    machine: MachineArguments,
    /// How nodes are stored; the picture is the same. Quantised ones are for strategy direct
    #[arg(long, value_enum, default_value_t)]
    nodes: NodeFormat,
    /// The OpenEXR file to write
    #[arg(short, long, value_name = "FILE", default_value = "caribou.exr")]
    output: PathBuf,
    /// Pixels across
    #[arg(long, default_value_t = Settings::default().width)]
    width: u32,
    /// Pixels down
    #[arg(long, default_value_t = Settings::default().height)]
    height: u32,
    /// Samples a pixel, 1 by default; with --noise-target or --time-limit the most of them, 4096 or 65536 by default
    #[arg(long)]
    spp: Option<u32>,
    /// Sample each tile of 8 x 4 pixels until its noise is at most this: the standard error of what is displayed, where
    /// 1 is white; exit with 1 if some are noisier in the end
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    noise_target: Option<f32>,
    /// Begin no further sample after so many seconds; each pixel gets at least one
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    time_limit: Option<f64>,
    /// Most bounces of a path: reflections, refractions and a diffuse bounce
    #[arg(long, value_name = "N", default_value_t = Settings::default().max_depth)]
    max_depth: u32,
    /// Seed of all random numbers
    #[arg(long, default_value_t = Settings::default().seed)]
    seed: u32,
    /// Factor on the light of the sky
    #[arg(long, default_value_t = Settings::default().sky, allow_negative_numbers = true)]
    sky: f32,
    /// Leave the sky out of the picture and write coverage as alpha
    #[arg(long)]
    transparent: bool,
    /// Further channels, separated by commas: Z, N, albedo, P, primId, steps, migrations, subtrees,
    /// samples, or all
    #[arg(long, value_name = "LIST")]
    aov: Option<String>,
    /// Bits of the colour channels
    #[arg(long, value_enum, default_value_t)]
    depth: Depth,
    /// Also write a tone-mapped PNG
    #[arg(long, value_name = "FILE")]
    preview: Option<PathBuf>,
    /// What the preview shows instead of colour: one of the --aov
    #[arg(long, value_name = "AOV", requires = "preview")]
    preview_aov: Option<String>,
    /// Factor on the colours of the preview
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    exposure: f32,
    /// Write statistics (schema caribou-render/1) to a file, or to standard output with -
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Print nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// The channels and the preview that were asked for.
struct Wanted {
    aovs: Vec<Aov>,
    preview: Preview,
}

impl Render {
    /// Renders and writes.
    pub fn run(&self) -> Result<()> {
        let start = Instant::now();
        let wanted = self.check()?;
        let gpu = self.device.open()?;
        let device_seconds = start.elapsed().as_secs_f64();
        let prepared = self.scene.prepare(self.quiet)?;
        let camera = select_camera(&prepared.scene, self.scene.camera.as_deref())?;
        let features = self.light.features(&prepared.scene);
        let picture = self.render(gpu.as_ref(), &prepared, &camera, features, &wanted)?;
        if let Some(message) = gpu.iter().flat_map(Gpu::validation_messages).next() {
            return Err(Error::Check(format!("validation: {message}")));
        }
        let steps = [
            ("device", device_seconds),
            ("load", prepared.load_seconds),
            ("build", prepared.build_seconds),
            ("setup", picture.setup_seconds),
            ("render", picture.render_seconds),
        ];
        let mut report = self.report(gpu.as_ref(), &prepared, features, &picture, &steps);
        let start = Instant::now();
        self.write(&picture, &camera, &wanted, &report)?;
        report.seconds.insert("write".to_owned(), start.elapsed().as_secs_f64());
        self.tell(&report)?;
        report.judge()
    }

    /// Refuses what cannot be done before any work.
    fn check(&self) -> Result<Wanted> {
        self.settings(1.0).check()?;
        self.tracing().check()?;
        let mut aovs = self.aov.as_deref().map_or(Ok(Vec::new()), Aov::parse_list)?;
        let preview = match self.preview_aov.as_deref().map(Aov::from_str).transpose()? {
            Some(aov) => Preview::Aov(aov),
            None => Preview::Color { exposure: self.exposure },
        };
        if let Preview::Aov(aov) = preview
            && !aovs.contains(&aov)
        {
            aovs.push(aov);
        }
        if !self.exposure.is_finite() || self.exposure <= 0.0 {
            return Err(Error::usage(format!("--exposure {}", self.exposure), "it must be a number above 0"));
        }
        let channels = 4 + aovs.iter().map(|aov| aov.components() as u64).sum::<u64>();
        check_picture(self.width, self.height, channels)?;
        let json = self.json.iter().filter(|path| path.as_os_str() != "-");
        for path in std::iter::once(&self.output).chain(&self.preview).chain(json) {
            check_writable(path)?;
        }
        Ok(Wanted { aovs, preview })
    }

    fn spp(&self) -> u32 {
        self.spp.unwrap_or(match (self.noise_target, self.time_limit) {
            (Some(_), _) => DEFAULT_MOST_SPP,
            (None, Some(_)) => MAX_SPP,
            (None, None) => Settings::default().spp,
        })
    }

    fn settings(&self, ao_radius: f32) -> Settings {
        Settings {
            width: self.width,
            height: self.height,
            spp: self.spp(),
            noise_target: self.noise_target,
            time_limit: self.time_limit,
            max_depth: self.max_depth,
            seed: self.seed,
            ao_radius,
            sky: self.sky,
            transparent: self.transparent,
        }
    }

    fn tracing(&self) -> TracerOptions {
        TracerOptions {
            strategy: self.strategy,
            machine: self.machine.options(),
            nodes: self.nodes,
            ..TracerOptions::default()
        }
    }

    fn render(
        &self,
        gpu: Option<&Gpu>,
        prepared: &Prepared,
        camera: &Camera,
        features: Features,
        wanted: &Wanted,
    ) -> Result<Picture> {
        let request = Request {
            bvh: &prepared.bvh,
            tables: &prepared.tables,
            camera,
            settings: self.settings(self.light.ao_radius(&prepared.bvh)),
            features,
            aovs: wanted.aovs.iter().any(|aov| *aov != Aov::Samples),
            tracing: self.tracing(),
        };
        let bar = Bar::new(self.quiet);
        let picture = picture(gpu, &request, &mut |progress| bar.update(progress));
        bar.finish();
        picture
    }

    fn report(
        &self,
        gpu: Option<&Gpu>,
        prepared: &Prepared,
        features: Features,
        picture: &Picture,
        steps: &[(&str, f64)],
    ) -> Report {
        let rays = picture.rays.iter().sum::<u64>() as f64;
        Report {
            head: Head {
                schema: "caribou-render/1",
                machine: Machine::new(gpu),
                scene: SceneSummary::new(&prepared.scene, &prepared.bvh),
                width: self.width,
                height: self.height,
            },
            spp: self.spp(),
            noise_target: self.noise_target,
            time_limit: self.time_limit,
            sampling: picture.sampling,
            max_depth: self.max_depth,
            seed: self.seed,
            tracing: Tracing::of(&self.tracing()),
            features,
            compiled_out: features.names().1,
            rays: named(&picture.rays),
            seconds: steps.iter().map(|(step, seconds)| ((*step).to_owned(), *seconds)).collect::<BTreeMap<_, _>>(),
            stage_seconds: picture.stage_seconds.clone(),
            mrays_per_s: rays * 1e-6 / picture.render_seconds.max(1e-9),
        }
    }

    fn write(&self, picture: &Picture, camera: &Camera, wanted: &Wanted, report: &Report) -> Result<()> {
        let image: Image = picture.film.image(&wanted.aovs, self.transparent, self.depth)?;
        if let Some(path) = &self.preview {
            let range = png::write(path, &image, wanted.preview)?;
            if let (Some(range), false) = (range, self.quiet) {
                output::print(&format!("preview  {} from {} to {}\n", path.display(), range.min, range.max))?;
            }
        }
        let (world_to_camera, world_to_ndc) = camera_matrices(camera, self.width as f32 / self.height as f32);
        let metadata = Metadata {
            scene: self.scene.name().to_owned(),
            world_to_camera,
            world_to_ndc,
            seed: self.seed.into(),
            spp: report.sampling.max,
            device: report.head.machine.device.clone(),
            render_seconds: picture.render_seconds,
            statistics: report.attributes(),
        };
        let written = exr::write(&self.output, image, &metadata)?;
        if written.clamped > 0 {
            output::warn(&format!(
                "{} values beyond the range of half floats were clamped to 65504; --depth float keeps them",
                written.clamped
            ));
        }
        Ok(())
    }

    fn tell(&self, report: &Report) -> Result<()> {
        if let Some(path) = &self.json {
            output::write_json(path, report)?;
        }
        if self.quiet || self.json.as_ref().is_some_and(|path| path.as_os_str() == "-") {
            return Ok(());
        }
        output::print(&format!("{}written  {}\n", report.summary(), self.output.display()))
    }
}
