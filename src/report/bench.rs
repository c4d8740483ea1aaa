//! The benchmark: how fast rays are traced, what they did in the tree, and a digest of all hits.

use std::collections::BTreeMap;
use std::time::Instant;

use serde::Serialize;

use super::head::Head;
use super::statistics::Median;
use crate::Result;
use crate::bvh::Bvh;
use crate::layout::{Frame, Hit, Ray, RayCounters};
use crate::render::rays::{RayKind, gpu_rays, twin_rays};
use crate::scene::tables::Tables;
use crate::trace::digest::{hit_count, hits_digest};
use crate::trace::{Geometry, Query, Stream, Tracer, TracerOptions};
use crate::twin;
use crate::vulkan::{Buffer, DeviceKind, Gpu, Place};

/// A GPU is kept busy this long before it is timed, because its clock is low after idling.
const WARM_UP_SECONDS: f64 = 0.5;

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
    /// `direct`.
    pub strategy: &'static str,
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
    pub counters: Counters,
}

/// Sums over all rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counters {
    /// Nodes fetched.
    pub node_visits: u64,
    /// Triangles tested.
    pub triangle_tests: u64,
}

impl Counters {
    fn of(counters: &[RayCounters]) -> Counters {
        counters.iter().fold(Counters::default(), |sum, ray| Counters {
            node_visits: sum.node_visits + u64::from(ray.node_visits),
            triangle_tests: sum.triangle_tests + u64::from(ray.triangle_tests),
        })
    }
}

/// Rays, their hits, and what each did in the tree.
pub struct Traced {
    /// The rays.
    pub rays: Vec<Ray>,
    /// One a ray.
    pub hits: Vec<Hit>,
    /// One a ray.
    pub counters: Vec<RayCounters>,
}

/// Something that makes and traces a benchmark's rays.
pub trait Bench {
    /// Makes rays of a kind and traces them once, counting.
    fn trace(&mut self, kind: RayKind) -> Result<Traced>;
    /// Times `runs` repetitions after a warm-up: seconds on the device's clock, and on the host's.
    fn time(&mut self, kind: RayKind, rays: &[Ray], runs: usize) -> Result<(Vec<f64>, Vec<f64>)>;
}

/// Makes, traces, counts and times the rays of a kind.
///
/// # Errors
/// [`crate::Error::Device`] if the device fails.
pub fn measure(bench: &mut dyn Bench, kind: RayKind, runs: usize) -> Result<(Outcome, Traced)> {
    let traced = bench.trace(kind)?;
    let (seconds, wall_seconds) = bench.time(kind, &traced.rays, runs)?;
    let ray_count = traced.rays.len() as u64;
    let rates: Vec<f64> = seconds.iter().filter(|s| **s > 0.0).map(|s| ray_count as f64 * 1e-6 / s).collect();
    let outcome = Outcome {
        strategy: "direct",
        rays: kind,
        ray_count,
        hits: hit_count(&traced.hits),
        hits_digest: hits_digest(&traced.hits),
        seconds,
        wall_seconds,
        mrays_per_s: Median::of(&rates),
        counters: Counters::of(&traced.counters),
    };
    Ok((outcome, traced))
}

/// The twin as a [`Bench`].
pub struct TwinBench<'a> {
    /// The tree.
    pub bvh: &'a Bvh,
    /// Attributes of its triangles.
    pub tables: &'a Tables,
    /// Camera and ray lengths.
    pub frame: Frame,
}

impl Bench for TwinBench<'_> {
    fn trace(&mut self, kind: RayKind) -> Result<Traced> {
        let rays = twin_rays(self.bvh, self.tables, &self.frame, kind);
        let (hits, counters) = self.trace_once(kind.query(), &rays);
        Ok(Traced { rays, hits, counters })
    }

    fn time(&mut self, kind: RayKind, rays: &[Ray], runs: usize) -> Result<(Vec<f64>, Vec<f64>)> {
        // The counting trace was the warm-up.
        let seconds: Vec<f64> = (0..runs)
            .map(|_| {
                let start = Instant::now();
                self.trace_once(kind.query(), rays);
                start.elapsed().as_secs_f64()
            })
            .collect();
        Ok((seconds.clone(), seconds))
    }
}

impl TwinBench<'_> {
    fn trace_once(&self, query: Query, rays: &[Ray]) -> (Vec<Hit>, Vec<RayCounters>) {
        match query {
            Query::Closest => twin::trace::trace_closest(self.bvh, rays),
            Query::Any => twin::trace::trace_any(self.bvh, rays),
        }
    }
}

/// A device as a [`Bench`].
pub struct GpuBench<'a> {
    gpu: &'a Gpu,
    tracer: Tracer,
    bvh: &'a Bvh,
    tables: &'a Tables,
    frame: Frame,
}

impl<'a> GpuBench<'a> {
    /// Uploads the scene.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if it does not fit.
    pub fn new(
        gpu: &'a Gpu,
        (bvh, tables): (&'a Bvh, &'a Tables),
        frame: Frame,
        options: TracerOptions,
    ) -> Result<GpuBench<'a>> {
        let tracer = Tracer::new(gpu, Geometry::upload(gpu, bvh)?, options)?;
        Ok(GpuBench { gpu, tracer, bvh, tables, frame })
    }

    /// What the driver says of the kernels that were timed.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the driver fails.
    pub fn kernels(&self) -> Result<BTreeMap<&'static str, BTreeMap<String, u64>>> {
        let mut all = BTreeMap::new();
        for query in [Query::Closest, Query::Any] {
            let pipeline = self.tracer.pipeline(self.gpu, query, false)?;
            let statistics: BTreeMap<String, u64> = pipeline.statistics().into_iter().collect();
            if !statistics.is_empty() {
                all.insert(pipeline.kernel().name(), statistics);
            }
        }
        Ok(all)
    }

    /// Most rays whose buffer still fits a binding.
    fn most_rays(&self) -> usize {
        (self.gpu.info().limits.storage_buffer_range / size_of::<Ray>() as u64) as usize
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
        rays.chunks(self.most_rays()).map(batch).collect()
    }

    /// Seconds of one trace of all batches, the mean of `times` in one submission: on the device's clock, and
    /// on the host's.
    fn repeat(&self, query: Query, batches: &[Batch], times: usize) -> Result<(f64, f64)> {
        let mut stream = Stream::new(self.gpu);
        let start = Instant::now();
        for _ in 0..times {
            for batch in batches {
                self.tracer.trace(&mut stream, "trace", query, (&batch.rays, &batch.hits, None), batch.count)?;
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
    fn trace(&mut self, kind: RayKind) -> Result<Traced> {
        let rays = gpu_rays(self.gpu, &self.tracer, (self.bvh, self.tables), &self.frame, kind)?;
        let (mut hits, mut counters) = (Vec::new(), Vec::new());
        for rays in rays.chunks(self.most_rays()) {
            let n = rays.len();
            let buffer = self.gpu.upload("rays", rays)?;
            let hit_buffer = self.gpu.buffer("hits", (n * size_of::<Hit>()) as u64, Place::Device)?;
            let counter_buffer = self.gpu.buffer("counters", (n * size_of::<RayCounters>()) as u64, Place::Device)?;
            let mut stream = Stream::new(self.gpu);
            let buffers = (&buffer, &hit_buffer, Some(&counter_buffer));
            self.tracer.trace(&mut stream, "trace", kind.query(), buffers, n as u32)?;
            stream.finish()?;
            hits.extend(self.gpu.download::<Hit>(&hit_buffer, 0..n)?);
            counters.extend(self.gpu.download::<RayCounters>(&counter_buffer, 0..n)?);
        }
        Ok(Traced { rays, hits, counters })
    }

    fn time(&mut self, kind: RayKind, rays: &[Ray], runs: usize) -> Result<(Vec<f64>, Vec<f64>)> {
        let (query, batches) = (kind.query(), self.batches(rays)?);
        let (mut once, _) = self.repeat(query, &batches, 1)?;
        let mut times = 1;
        if self.gpu.info().kind != DeviceKind::Cpu && !rays.is_empty() {
            let start = Instant::now();
            while start.elapsed().as_secs_f64() < WARM_UP_SECONDS {
                times = ((RUN_SECONDS / once.max(1e-9)).ceil() as usize).clamp(1, 1000);
                (once, _) = self.repeat(query, &batches, times)?;
            }
        }
        let runs: Vec<(f64, f64)> = (0..runs).map(|_| self.repeat(query, &batches, times)).collect::<Result<_>>()?;
        Ok(runs.into_iter().unzip())
    }
}
