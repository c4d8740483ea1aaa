//! The stages on the CPU, by the twins.

use std::collections::BTreeMap;
use std::time::Instant;

use bytemuck::Zeroable;

use super::features::Features;
use super::film::Batch;
use super::stages::{RayCounts, Stages};
use crate::Result;
use crate::bvh::Bvh;
use crate::layout::{Contribution, Frame, Hit, Path, Ray, RayCounters, StagePush};
use crate::scene::tables::Tables;
use crate::shared::*;
use crate::trace::{Query, TracerOptions, TwinTracer};
use crate::twin;
use crate::twin::surface::Stage;

/// Paths of a batch: keeps its buffers within the caches of a server.
const BATCH: u32 = 1 << 16;

/// Buffers of a batch and the scene that they read.
pub struct Cpu<'a> {
    bvh: &'a Bvh,
    tables: &'a Tables,
    frame: Frame,
    features: Features,
    push: StagePush,
    rays: Vec<Ray>,
    hits: Vec<Hit>,
    counters: Vec<RayCounters>,
    paths: Vec<Path>,
    tiles: Vec<u32>,
    batch: Batch,
    counts: RayCounts,
    seconds: BTreeMap<String, f64>,
    tracer: TwinTracer<'a>,
}

impl<'a> Cpu<'a> {
    /// Stages for one picture.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] for options out of range.
    pub fn new(
        (bvh, tables): (&'a Bvh, &'a Tables),
        frame: Frame,
        features: Features,
        options: &TracerOptions,
    ) -> Result<Cpu<'a>> {
        Ok(Cpu {
            tracer: TwinTracer::new(bvh, options)?,
            bvh,
            tables,
            frame,
            features,
            push: StagePush::zeroed(),
            rays: Vec::new(),
            hits: Vec::new(),
            counters: Vec::new(),
            paths: Vec::new(),
            tiles: Vec::new(),
            batch: Batch::default(),
            counts: RayCounts::default(),
            seconds: BTreeMap::new(),
        })
    }

    fn timed<T>(&mut self, stage: &str, work: impl FnOnce(&mut Self) -> T) -> T {
        let start = Instant::now();
        let result = work(self);
        *self.seconds.entry(stage.to_owned()).or_default() += start.elapsed().as_secs_f64();
        result
    }
}

/// What the shading twins read, without borrowing the batch.
macro_rules! stage {
    ($cpu:expr) => {
        Stage { bvh: $cpu.bvh, tables: $cpu.tables, frame: &$cpu.frame }
    };
}

impl Stages for Cpu<'_> {
    fn capacity(&self) -> u32 {
        BATCH
    }

    fn choose(&mut self, tiles: &[u32]) -> Result<()> {
        self.tiles = tiles.to_vec();
        Ok(())
    }

    fn begin(&mut self, first: u32, count: u32) {
        self.push = StagePush { first, count, sample_index: 0, argument: 0 };
        let count = count as usize;
        self.rays = vec![Ray::DEAD; count];
        self.paths = vec![Path::zeroed(); count];
        self.batch = Batch { sums: vec![[0.0; 4]; count], spreads: vec![0.0; count], aovs: Vec::new() };
    }

    fn generate(&mut self, sample: u32) -> Result<()> {
        self.push.sample_index = sample;
        self.timed("generate", |s| twin::generate::generate(&s.frame, s.push, &s.tiles, &mut s.rays, &mut s.paths));
        Ok(())
    }

    fn trace_closest(&mut self, _coherent: bool) -> Result<()> {
        let traced = self.timed("trace closest", |s| s.tracer.trace(Query::Closest, &s.rays))?;
        (self.hits, self.counters) = (traced.hits, traced.counters);
        Ok(())
    }

    fn aov(&mut self) -> Result<()> {
        self.timed("aov", |s| {
            s.batch.aovs = vec![Zeroable::zeroed(); s.rays.len()];
            twin::aov::aov(stage!(s), &s.rays, &s.hits, &s.counters, &mut s.batch.aovs);
        });
        Ok(())
    }

    fn light(&mut self, light: u32, _coherent: bool) -> Result<()> {
        let push = StagePush { argument: light, ..self.push };
        let mut shadow_rays = vec![Ray::DEAD; self.rays.len()];
        let mut contributions = vec![Contribution::zeroed(); self.rays.len()];
        let made = self.timed("light", |s| {
            let inputs = (&s.rays[..], &s.hits[..], &s.paths[..]);
            twin::light::light(stage!(s), push, inputs, &mut shadow_rays, &mut contributions)
        });
        self.counts[if light == LIGHT_AMBIENT { KIND_AO } else { KIND_SHADOW } as usize] += made;
        let shadow_hits = self.timed("trace any", |s| s.tracer.trace(Query::Any, &shadow_rays))?.hits;
        self.timed("gather", |s| twin::gather::gather(&shadow_rays, &shadow_hits, &contributions, &mut s.paths));
        Ok(())
    }

    fn shade(&mut self) -> Result<()> {
        let made = self.timed("shade", |s| {
            let indirect = s.features.indirect_code();
            twin::shade::shade(stage!(s), s.push, indirect, &mut s.rays, &s.hits, &mut s.paths)
        });
        self.counts.iter_mut().zip(made).for_each(|(sum, new)| *sum += new);
        Ok(())
    }

    fn resolve(&mut self, before: u32) -> Result<()> {
        let push = StagePush { argument: before, ..self.push };
        self.timed("resolve", |s| {
            twin::resolve::resolve(&s.frame, push, &s.paths, &mut s.batch.sums, &mut s.batch.spreads);
        });
        Ok(())
    }

    fn take_ray_counts(&mut self) -> Result<RayCounts> {
        Ok(std::mem::take(&mut self.counts))
    }

    fn read(&mut self, _aovs: bool) -> Result<Batch> {
        Ok(std::mem::take(&mut self.batch))
    }

    fn seconds(&self) -> BTreeMap<String, f64> {
        self.seconds.clone()
    }
}
