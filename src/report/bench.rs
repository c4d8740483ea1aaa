//! The benchmark: how fast rays are traced, what they did in the tree, and a digest of all hits.

use std::collections::BTreeMap;
use std::time::Instant;

use serde::Serialize;

use super::head::Head;
use super::statistics::Median;
use super::tracing::Tracing;
use crate::Result;
use crate::bvh::Bvh;
use crate::layout::{Frame, Hit, Ray, RayCounters};
use crate::render::rays::{RayKind, gpu_rays, twin_rays};
use crate::scene::tables::Tables;
use crate::trace::accounting::{MigrationReport, Totals, WarpCounters};
use crate::trace::digest::{hit_count, hits_digest};
use crate::trace::twin_tracer::{Traced, TwinTracer};
use crate::trace::{Query, RayBuffers, RayFeatures, StepSample, Strategy, Stream, Tracer, TracerOptions};
use crate::twin::tiles::tile_count;
use crate::vulkan::{Buffer, DeviceKind, Gpu, Place};

/// Name and version of the report's format.
pub const SCHEMA: &str = "caribou-bench/1";

/// A GPU is kept busy this long before it is timed, because its clock is low after idling.
const WARM_UP_SECONDS: f64 = 0.5;

/// Rays of a batch that are counted, and of any batch of strategy `migrate`: counters of the largest fit a binding of
/// 128 MiB, the least that drivers must offer. The same on every device, so that queues and rounds are.
const COUNTED_RAYS: u32 = 1 << 21;

/// Rays of any other batch: the largest fit such a binding.
const MOST_RAYS: u32 = 1 << 22;

/// A timed run on a GPU repeats the dispatch until it takes about this long.
const RUN_SECONDS: f64 = 0.02;

/// Schema `caribou-bench/1`.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// What it is of.
    #[serde(flatten)]
    pub head: Head,
    /// Length of ambient occlusion rays.
    pub ao_radius: f32,
    /// Seed of the secondary rays.
    pub seed: u32,
    /// `exact`, or `driver` where reciprocals were taken as the driver rounds them.
    pub arithmetic: &'static str,
    /// What the driver says of the compiled kernels, where it does: registers, for example.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub kernels: BTreeMap<&'static str, BTreeMap<String, u64>>,
    /// One a strategy and ray kind.
    pub results: Vec<Outcome>,
}

/// Result of a strategy on a kind of rays.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// How rays were traced.
    #[serde(flatten)]
    pub tracing: Tracing,
    /// The rays.
    pub rays: RayKind,
    /// Rays traced.
    pub ray_count: u64,
    /// Rays that hit.
    pub hits: u64,
    /// Digest of primitive and t bits of all hits.
    pub hits_digest: String,
    /// Seconds of each run: on the device's clock where it has one.
    pub seconds: Vec<f64>,
    /// Seconds of each run on the host's clock.
    pub wall_seconds: Vec<f64>,
    /// Million rays a second, from `seconds`.
    pub mrays_per_s: Option<Median>,
    /// What the rays did in the tree, summed.
    pub counters: Totals,
    /// Warps and lanes, in launch order or, with strategy `migrate`, in queue order and without the first walk of
    /// the top tree.
    pub warps: WarpCounters,
    /// Rounds and SMs of strategy `migrate`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub migration: Option<MigrationReport>,
    /// What the driver counted in the same run, where it can. It need not be the same on another device.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub driver_counters: Option<DriverCounted>,
}

/// Counters of the driver's own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct DriverCounted {
    /// Invocations of all kernels of the strategy.
    pub compute_shader_invocations: u64,
}

/// Something that makes and traces a benchmark's rays.
pub trait Bench {
    /// Makes rays of a kind.
    fn rays(&mut self, kind: RayKind) -> Result<Vec<Ray>>;
    /// Traces them once, counting.
    fn trace(&mut self, kind: RayKind, rays: &[Ray]) -> Result<Traced>;
    /// Traces them and records the steps of the rays `which`, in rising order.
    fn record(&mut self, kind: RayKind, rays: &[Ray], which: Vec<u64>) -> Result<StepSample>;
    /// Times `runs` repetitions after a warm-up: seconds on the device's clock, and on the host's.
    fn time(&mut self, kind: RayKind, rays: &[Ray], runs: usize) -> Result<(Vec<f64>, Vec<f64>)>;
}

/// Makes, traces, counts and times the rays of a kind.
///
/// # Errors
/// [`crate::Error::Device`] if the device fails.
pub fn measure(
    bench: &mut dyn Bench,
    options: &TracerOptions,
    kind: RayKind,
    rays: &[Ray],
    runs: usize,
) -> Result<(Outcome, Traced)> {
    let traced = bench.trace(kind, rays)?;
    let (seconds, wall_seconds) = bench.time(kind, rays, runs)?;
    let ray_count = rays.len() as u64;
    let rates: Vec<f64> = seconds.iter().filter(|s| **s > 0.0).map(|s| ray_count as f64 * 1e-6 / s).collect();
    let outcome = Outcome {
        tracing: Tracing::of(options),
        rays: kind,
        ray_count,
        hits: hit_count(&traced.hits),
        hits_digest: hits_digest(&traced.hits),
        seconds,
        wall_seconds,
        mrays_per_s: Median::of(&rates),
        counters: Totals::of(&traced.counters),
        warps: match &traced.migration {
            Some(report) => report.warps(),
            None => WarpCounters::of(traced.counters.iter()),
        },
        migration: traced.migration.clone(),
        driver_counters: traced
            .invocations
            .map(|compute_shader_invocations| DriverCounted { compute_shader_invocations }),
    };
    Ok((outcome, traced))
}

/// The twin as a [`Bench`].
pub struct TwinBench<'a> {
    bvh: &'a Bvh,
    tables: &'a Tables,
    frame: Frame,
    tracer: TwinTracer<'a>,
}

impl<'a> TwinBench<'a> {
    /// Prepares the twins for a scene.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] for options out of range.
    pub fn new((bvh, tables): (&'a Bvh, &'a Tables), frame: Frame, options: &TracerOptions) -> Result<TwinBench<'a>> {
        Ok(TwinBench { bvh, tables, frame, tracer: TwinTracer::new(bvh, options)? })
    }
}

impl Bench for TwinBench<'_> {
    fn rays(&mut self, kind: RayKind) -> Result<Vec<Ray>> {
        Ok(twin_rays(self.bvh, self.tables, &self.frame, kind))
    }

    fn trace(&mut self, kind: RayKind, rays: &[Ray]) -> Result<Traced> {
        self.tracer.trace(kind.query(), rays)
    }

    fn record(&mut self, kind: RayKind, rays: &[Ray], which: Vec<u64>) -> Result<StepSample> {
        Ok(self.tracer.record(kind.query(), rays, which))
    }

    fn time(&mut self, kind: RayKind, rays: &[Ray], runs: usize) -> Result<(Vec<f64>, Vec<f64>)> {
        // The counting trace was the warm-up.
        let time = |_| {
            let start = Instant::now();
            self.tracer.trace(kind.query(), rays)?;
            Ok(start.elapsed().as_secs_f64())
        };
        let seconds = (0..runs).map(time).collect::<Result<Vec<f64>>>()?;
        Ok((seconds.clone(), seconds))
    }
}

/// A device as a [`Bench`].
pub struct GpuBench<'a> {
    gpu: &'a Gpu,
    tracer: Tracer,
    bvh: &'a Bvh,
    tables: &'a Tables,
    frame: Frame,
    most_rays: u32,
}

impl<'a> GpuBench<'a> {
    /// Uploads the scene.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] for options out of range, [`crate::Error::Device`] if it does not fit.
    pub fn new(
        gpu: &'a Gpu,
        (bvh, tables): (&'a Bvh, &'a Tables),
        frame: Frame,
        options: &TracerOptions,
    ) -> Result<GpuBench<'a>> {
        let most_rays = if options.strategy == Strategy::Migrate { COUNTED_RAYS } else { MOST_RAYS };
        let rays = tile_count(frame.width, frame.height).unwrap_or(most_rays).min(most_rays);
        let tracer = Tracer::new(gpu, bvh, options, rays)?;
        Ok(GpuBench { gpu, tracer, bvh, tables, frame, most_rays })
    }

    /// What the driver says of the kernels that were timed.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the driver fails.
    pub fn kernels(&self) -> Result<BTreeMap<&'static str, BTreeMap<String, u64>>> {
        let mut all = BTreeMap::new();
        for pipeline in
            self.tracer.pipelines(self.gpu, Query::Closest, RayFeatures { coherent: true, ..RayFeatures::default() })?
        {
            let statistics: BTreeMap<String, u64> = pipeline.statistics().into_iter().collect();
            if !statistics.is_empty() {
                all.insert(pipeline.kernel().name(), statistics);
            }
        }
        Ok(all)
    }

    /// Uploads rays, in parts that fit a binding, with room for their hits.
    fn batches(&self, rays: &[Ray]) -> Result<Vec<Batch>> {
        let batch = |rays: &[Ray]| {
            Ok(Batch {
                rays: self.gpu.upload("rays", rays)?,
                hits: self.gpu.buffer("hits", size_of::<Hit>() as u64 * rays.len() as u64, Place::Device)?,
                count: rays.len() as u32,
            })
        };
        rays.chunks(self.most_rays as usize).map(batch).collect()
    }

    /// Seconds of one trace of all batches, the mean of `times` in one submission: on the device's clock, and
    /// on the host's.
    fn repeat(&self, kind: RayKind, batches: &[Batch], times: usize) -> Result<(f64, f64)> {
        let mut stream = Stream::new(self.gpu);
        let start = Instant::now();
        for _ in 0..times {
            for batch in batches {
                let buffers = RayBuffers::new(&batch.rays, &batch.hits).coherent(kind.coherent());
                self.tracer.trace(&mut stream, "trace", kind.query(), &buffers, batch.count)?;
            }
        }
        stream.finish()?;
        let wall = start.elapsed().as_secs_f64();
        let device: f64 = stream.take_seconds().values().sum();
        // Drivers without timestamps leave the host's clock.
        let device = if device > 0.0 { device } else { wall };
        Ok((device / times as f64, wall / times as f64))
    }
}

/// Rays on the device.
struct Batch {
    rays: Buffer,
    hits: Buffer,
    count: u32,
}

impl Bench for GpuBench<'_> {
    fn rays(&mut self, kind: RayKind) -> Result<Vec<Ray>> {
        gpu_rays(self.gpu, &self.tracer, (self.bvh, self.tables), &self.frame, kind)
    }

    fn trace(&mut self, kind: RayKind, rays: &[Ray]) -> Result<Traced> {
        let mut traced = Traced { hits: Vec::new(), counters: Vec::new(), migration: None, invocations: None };
        for rays in rays.chunks(COUNTED_RAYS as usize) {
            let n = rays.len();
            let buffer = self.gpu.upload("rays", rays)?;
            let hit_buffer = self.gpu.buffer("hits", (n * size_of::<Hit>()) as u64, Place::Device)?;
            let counter_buffer = self.gpu.buffer("counters", (n * size_of::<RayCounters>()) as u64, Place::Device)?;
            let mut stream = Stream::counting(self.gpu);
            let buffers = RayBuffers::new(&buffer, &hit_buffer).coherent(kind.coherent()).counted(&counter_buffer);
            let report = self.tracer.trace(&mut stream, "trace", kind.query(), &buffers, n as u32)?;
            stream.finish()?;
            traced.hits.extend(self.gpu.download::<Hit>(&hit_buffer, 0..n)?);
            traced.counters.extend(self.gpu.download::<RayCounters>(&counter_buffer, 0..n)?);
            if let Some(more) = stream.invocations() {
                *traced.invocations.get_or_insert(0) += more;
            }
            if let Some(more) = report {
                traced.migration.get_or_insert_default().append(more);
            }
        }
        Ok(traced)
    }

    fn record(&mut self, kind: RayKind, rays: &[Ray], which: Vec<u64>) -> Result<StepSample> {
        let mut all = StepSample::default();
        for (first, rays) in (0..).step_by(COUNTED_RAYS as usize).zip(rays.chunks(COUNTED_RAYS as usize)) {
            let batch = first..first + rays.len() as u64;
            let inside = which.iter().filter(|ray| batch.contains(ray)).map(|ray| ray - first).collect();
            all.append(first, &StepSample::by_kernels(self.gpu, &self.tracer, kind.query(), rays, inside)?);
        }
        Ok(all)
    }

    fn time(&mut self, kind: RayKind, rays: &[Ray], runs: usize) -> Result<(Vec<f64>, Vec<f64>)> {
        let batches = self.batches(rays)?;
        let (mut once, _) = self.repeat(kind, &batches, 1)?;
        let mut times = 1;
        if self.gpu.info().kind != DeviceKind::Cpu && !rays.is_empty() {
            let start = Instant::now();
            while start.elapsed().as_secs_f64() < WARM_UP_SECONDS {
                times = ((RUN_SECONDS / once.max(1e-9)).ceil() as usize).clamp(1, 1000);
                (once, _) = self.repeat(kind, &batches, times)?;
            }
        }
        let runs: Vec<(f64, f64)> = (0..runs).map(|_| self.repeat(kind, &batches, times)).collect::<Result<_>>()?;
        Ok(runs.into_iter().unzip())
    }
}
