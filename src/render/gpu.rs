//! The stages on a Vulkan device.

use std::collections::BTreeMap;

use super::features::Features;
use super::film::Batch;
use super::gpu_scene::GpuScene;
use super::stages::{RayCounts, Stages};
use crate::Result;
use crate::bvh::Bvh;
use crate::layout::{AovPixel, Contribution, Frame, Hit, Path, Ray, RayCounters, StagePush};
use crate::scene::tables::Tables;
use crate::shared::KINDS;
use crate::trace::tracer::exactness;
use crate::trace::{Query, RayBuffers, Stream, Tracer, TracerOptions};
use crate::vulkan::{Buffer, DeviceKind, Gpu, Kernel, Pipeline, Place};

/// Paths of a batch on a software driver, whose memory is the host's.
const BATCH_CPU: u32 = 1 << 17;
/// Paths of a batch on a GPU, which wants them by the million.
const BATCH_GPU: u32 = 1 << 20;

/// Buffers of a batch, the scene, and the kernels.
pub struct GpuStages<'g> {
    stream: Stream<'g>,
    tracer: Tracer,
    scene: GpuScene,
    kernels: Kernels,
    buffers: Buffers,
    capacity: u32,
    aovs: bool,
    push: StagePush,
    counted: RayCounts,
    seconds: BTreeMap<String, f64>,
}

struct Kernels {
    generate: Pipeline,
    light: Pipeline,
    gather: Pipeline,
    shade: Pipeline,
    resolve: Pipeline,
    aov: Pipeline,
}

struct Buffers {
    rays: Buffer,
    hits: Buffer,
    counters: Buffer,
    paths: Buffer,
    shadow_rays: Buffer,
    shadow_hits: Buffer,
    contributions: Buffer,
    ray_counts: Buffer,
    tiles: Buffer,
    sums: Buffer,
    spreads: Buffer,
    aovs: Buffer,
}

impl<'g> GpuStages<'g> {
    /// Stages for one picture of up to `paths` paths at a time, with or without what camera rays met.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails or lacks memory.
    pub fn new(
        gpu: &'g Gpu,
        (bvh, tables): (&Bvh, &Tables),
        frame: Frame,
        features: Features,
        (paths, aovs): (u32, bool),
        options: &TracerOptions,
    ) -> Result<Self> {
        let most = if gpu.info().kind == DeviceKind::Cpu { BATCH_CPU } else { BATCH_GPU };
        let capacity = most.min(paths);
        let tracer = Tracer::new(gpu, bvh, options, capacity)?;
        let scene = GpuScene::upload(gpu, bvh, tracer.geometry(), tables, frame)?;
        let mut spec = exactness(gpu.probe()).to_vec();
        spec.extend(features.specialization());
        Ok(GpuStages {
            stream: Stream::new(gpu),
            tracer,
            scene,
            kernels: Kernels::new(gpu, &spec)?,
            buffers: Buffers::new(gpu, capacity, aovs)?,
            capacity,
            aovs,
            push: bytemuck::Zeroable::zeroed(),
            counted: RayCounts::default(),
            seconds: BTreeMap::new(),
        })
    }

    fn finish(&mut self) -> Result<()> {
        self.stream.finish()?;
        for (stage, seconds) in self.stream.take_seconds() {
            *self.seconds.entry(stage).or_default() += seconds;
        }
        Ok(())
    }

    fn run(&mut self, kernel: Kernel, argument: u32) -> Result<()> {
        let (s, b, k) = (&self.scene, &self.buffers, &self.kernels);
        let push = StagePush { argument, ..self.push };
        let (pipeline, buffers): (_, &[&Buffer]) = match kernel {
            Kernel::Generate => (&k.generate, &[&s.frame, &b.rays, &b.paths, &b.tiles]),
            Kernel::Light => (
                &k.light,
                &[
                    &s.frame,
                    &s.materials,
                    &s.textures,
                    &s.lights,
                    &b.rays,
                    &b.hits,
                    &b.paths,
                    &b.shadow_rays,
                    &b.contributions,
                    &b.ray_counts,
                ],
            ),
            Kernel::Gather => (&k.gather, &[&s.frame, &b.shadow_rays, &b.shadow_hits, &b.contributions, &b.paths]),
            Kernel::Shade => {
                (&k.shade, &[&s.frame, &s.materials, &s.textures, &b.rays, &b.hits, &b.paths, &b.ray_counts])
            }
            Kernel::Resolve => (&k.resolve, &[&s.frame, &b.paths, &b.sums, &b.spreads]),
            Kernel::Aov => (&k.aov, &[&s.frame, &s.materials, &s.textures, &b.rays, &b.hits, &b.counters, &b.aovs]),
            other => unreachable!("{} is not a stage of a picture", other.name()),
        };
        let mut reached: Vec<&Buffer> = s.reached.iter().collect();
        reached.push(&self.tracer.geometry().tree);
        self.stream.dispatch(kernel.name(), pipeline, (buffers, &reached), &push, push.count)
    }
}

impl Kernels {
    fn new(gpu: &Gpu, spec: &[(u32, u32)]) -> Result<Kernels> {
        Ok(Kernels {
            generate: gpu.pipeline(Kernel::Generate, spec)?,
            light: gpu.pipeline(Kernel::Light, spec)?,
            gather: gpu.pipeline(Kernel::Gather, spec)?,
            shade: gpu.pipeline(Kernel::Shade, spec)?,
            resolve: gpu.pipeline(Kernel::Resolve, spec)?,
            aov: gpu.pipeline(Kernel::Aov, spec)?,
        })
    }
}

impl Buffers {
    fn new(gpu: &Gpu, paths: u32, aovs: bool) -> Result<Buffers> {
        let of = |label: &str, bytes: usize, wanted: bool| {
            gpu.buffer(label, if wanted { bytes as u64 * u64::from(paths) } else { 0 }, Place::Device)
        };
        Ok(Buffers {
            rays: of("rays", size_of::<Ray>(), true)?,
            hits: of("hits", size_of::<Hit>(), true)?,
            counters: of("counters", size_of::<RayCounters>(), aovs)?,
            paths: of("paths", size_of::<Path>(), true)?,
            shadow_rays: of("shadow rays", size_of::<Ray>(), true)?,
            shadow_hits: of("shadow hits", size_of::<Hit>(), true)?,
            contributions: of("contributions", size_of::<Contribution>(), true)?,
            ray_counts: gpu.upload("ray counts", &[0u32; KINDS as usize])?,
            tiles: of("tiles", 0, false)?,
            sums: of("sums", size_of::<[f32; 4]>(), true)?,
            spreads: of("spreads", size_of::<f32>(), true)?,
            aovs: of("aovs", size_of::<AovPixel>(), aovs)?,
        })
    }
}

impl Stages for GpuStages<'_> {
    fn capacity(&self) -> u32 {
        self.capacity
    }

    fn choose(&mut self, tiles: &[u32]) -> Result<()> {
        // The work that reads the last choice is done: its batches were read.
        self.buffers.tiles = self.stream.gpu().upload("tiles", tiles)?;
        Ok(())
    }

    fn begin(&mut self, first: u32, count: u32) {
        self.push = StagePush { first, count, sample_index: 0, argument: 0 };
    }

    fn generate(&mut self, sample: u32) -> Result<()> {
        self.push.sample_index = sample;
        self.run(Kernel::Generate, 0)
    }

    fn trace_closest(&mut self, coherent: bool) -> Result<()> {
        let b = &self.buffers;
        let counters = self.aovs.then_some(&b.counters);
        let buffers = RayBuffers { counters, coherent, ..RayBuffers::new(&b.rays, &b.hits) };
        self.tracer.trace(&mut self.stream, "trace closest", Query::Closest, &buffers, self.push.count)?;
        Ok(())
    }

    fn aov(&mut self) -> Result<()> {
        self.run(Kernel::Aov, 0)
    }

    fn light(&mut self, light: u32, coherent: bool) -> Result<()> {
        self.run(Kernel::Light, light)?;
        let b = &self.buffers;
        let buffers = RayBuffers::new(&b.shadow_rays, &b.shadow_hits).coherent(coherent);
        self.tracer.trace(&mut self.stream, "trace any", Query::Any, &buffers, self.push.count)?;
        self.run(Kernel::Gather, 0)
    }

    fn shade(&mut self) -> Result<()> {
        self.run(Kernel::Shade, 0)
    }

    fn resolve(&mut self, before: u32) -> Result<()> {
        self.run(Kernel::Resolve, before)
    }

    fn take_ray_counts(&mut self) -> Result<RayCounts> {
        self.finish()?;
        // The device counts on in 32 bits; differences are right as long as they are below 2^32.
        let now = self.stream.gpu().download::<u32>(&self.buffers.ray_counts, 0..KINDS as usize)?;
        let mut made = RayCounts::default();
        for ((made, counted), now) in made.iter_mut().zip(&mut self.counted).zip(now) {
            *made = u64::from(now.wrapping_sub(*counted as u32));
            *counted = u64::from(now);
        }
        Ok(made)
    }

    fn read(&mut self, aovs: bool) -> Result<Batch> {
        self.finish()?;
        let (gpu, count) = (self.stream.gpu(), self.push.count as usize);
        Ok(Batch {
            sums: gpu.download(&self.buffers.sums, 0..count)?,
            spreads: gpu.download(&self.buffers.spreads, 0..count)?,
            aovs: if aovs { gpu.download(&self.buffers.aovs, 0..count)? } else { Vec::new() },
        })
    }

    fn seconds(&self) -> BTreeMap<String, f64> {
        self.seconds.clone()
    }
}
