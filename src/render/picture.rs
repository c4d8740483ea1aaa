//! A whole picture on a device or on the twin.

use std::collections::BTreeMap;
use std::time::Instant;

use super::cpu::Cpu;
use super::features::{Features, Indirect};
use super::film::Film;
use super::gpu::GpuStages;
use super::integrator::{Plan, Progress, Rendered, render};
use super::noise::SamplingSummary;
use super::settings::Settings;
use super::stages::{RayCounts, Stages};
use crate::Result;
use crate::bvh::Bvh;
use crate::layout::Frame;
use crate::scene::Camera;
use crate::scene::tables::Tables;
use crate::trace::TracerOptions;
use crate::twin::tiles::tile_count;
use crate::vulkan::Gpu;

/// What is to be rendered.
pub struct Request<'a> {
    /// The tree.
    pub bvh: &'a Bvh,
    /// Materials, lights and attributes.
    pub tables: &'a Tables,
    /// Where from.
    pub camera: &'a Camera,
    /// Size and sampling.
    pub settings: Settings,
    /// What the scene needs of the kernels.
    pub features: Features,
    /// Whether to keep what the camera rays meet.
    pub aovs: bool,
    /// How rays are traced.
    pub tracing: TracerOptions,
}

/// A picture and what it took.
pub struct Picture {
    /// The pixels.
    pub film: Film,
    /// Rays traced.
    pub rays: RayCounts,
    /// Samples and noise.
    pub sampling: SamplingSummary,
    /// Seconds by stage.
    pub stage_seconds: BTreeMap<String, f64>,
    /// Seconds to upload the scene and compile the kernels.
    pub setup_seconds: f64,
    /// Seconds from the first ray to the last pixel.
    pub render_seconds: f64,
}

/// Renders on `gpu`, or on the CPU without one.
///
/// # Errors
/// [`crate::Error::Usage`] for settings out of range, [`crate::Error::Device`] if the device fails.
pub fn picture(gpu: Option<&Gpu>, request: &Request, report: &mut dyn FnMut(Progress)) -> Result<Picture> {
    request.settings.check()?;
    let start = Instant::now();
    let lit = u32::from(!request.tables.lights.is_empty());
    let frame = Frame { lit, ..request.settings.frame(request.camera) };
    let scene = (request.bvh, request.tables);
    let paths = tile_count(request.settings.width, request.settings.height).unwrap_or(u32::MAX);
    let mut stages: Box<dyn Stages> = match gpu {
        Some(gpu) => {
            Box::new(GpuStages::new(gpu, scene, frame, request.features, (paths, request.aovs), &request.tracing)?)
        }
        None => Box::new(Cpu::new(scene, frame, request.features, &request.tracing)?),
    };
    let setup_seconds = start.elapsed().as_secs_f64();
    let plan = Plan {
        lights: request.tables.lights.len() as u32,
        ambient: request.features.indirect == Indirect::Ao,
        bounces: request.features.bounces(),
        aovs: request.aovs,
    };
    let start = Instant::now();
    let seconds = || start.elapsed().as_secs_f64();
    let Rendered { film, rays, sampling } = render(stages.as_mut(), &request.settings, plan, &seconds, report)?;
    let render_seconds = start.elapsed().as_secs_f64();
    Ok(Picture { film, rays, sampling, stage_seconds: stages.seconds(), setup_seconds, render_seconds })
}
