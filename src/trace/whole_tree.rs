//! Strategies `direct` and `persistent` on the device: each ray's way through the whole tree at a stretch,
//! unless the driver makes invocations stop.

use super::geometry::Geometry;
use super::stream::Stream;
use super::tracer::RayBuffers;
use crate::Result;
use crate::layout::{TracePush, Travel};
use crate::shared::WARP;
use crate::vulkan::{Buffer, Gpu, Pipeline, Place};

/// Rays of a dispatch of `direct` that can be suspended: bounds the memory for their places to 16 MiB.
const SUSPENDABLE: u32 = 1 << 20;

/// Most rays of a strip, and strips below which they get shorter, so that all threads of a software driver have some.
const LONGEST_STRIP: u32 = 4096;
const LEAST_STRIPS: u32 = 64;

/// How rays are given to invocations.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Dealt {
    /// One each: strategy `direct`.
    Each,
    /// A strip to each workgroup: strategy `direct` with the kernels for software drivers.
    Strips,
    /// To so many invocations, as they ask: strategy `persistent`.
    OnDemand(u32),
}

/// How rays are given to invocations, and where suspended ones wait.
pub struct WholeTree {
    dealt: Dealt,
    /// Most rays of a dispatch.
    chunk: u32,
    /// Whether rays can be suspended.
    limited: bool,
    travels: Buffer,
    unfinished: Buffer,
    next_ray: Buffer,
}

impl WholeTree {
    /// Makes room for the rays that a dispatch may leave suspended.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if memory is short.
    pub fn new(gpu: &Gpu, dealt: Dealt, limited: bool, most_rays: u32) -> Result<WholeTree> {
        let most = gpu.info().limits.groups.saturating_mul(WARP);
        let chunk = match dealt {
            Dealt::OnDemand(_) => i32::MAX as u32,
            _ if limited => most.min(SUSPENDABLE).min(most_rays),
            Dealt::Strips => most.min(most_rays),
            Dealt::Each => most,
        };
        let suspended = match dealt {
            _ if !limited => 0,
            Dealt::OnDemand(invocations) => invocations.into(),
            _ => chunk.into(),
        };
        let strips = match dealt {
            Dealt::Strips => u64::from(chunk.div_ceil(LONGEST_STRIP).max(LEAST_STRIPS)),
            _ => 1,
        };
        Ok(WholeTree {
            dealt,
            chunk,
            limited,
            travels: gpu.buffer("suspended rays", suspended * size_of::<Travel>() as u64, Place::Device)?,
            unfinished: gpu.buffer("unfinished rays", 4, Place::Device)?,
            next_ray: gpu.buffer("next rays", 4 * strips, Place::Device)?,
        })
    }

    /// Whether rays can be suspended; kernels then trace one ray an invocation, or one after the other.
    pub fn limited(&self) -> bool {
        self.limited
    }

    /// Records the tracing of `count` rays. Where invocations are limited this also runs the stream, as often
    /// as it takes.
    ///
    /// # Errors
    /// [`crate::Error::Device`] naming `stage`.
    pub fn trace(
        &self,
        stream: &mut Stream,
        stage: &str,
        (pipeline, geometry): (&Pipeline, &Geometry),
        buffers: &RayBuffers,
        count: u32,
    ) -> Result<()> {
        for first in (0..count).step_by(self.chunk as usize) {
            let count = self.chunk.min(count - first);
            let push = TracePush {
                nodes: geometry.nodes(),
                triangles: geometry.triangles(),
                scene_low: geometry.bounds[0],
                first,
                scene_high: geometry.bounds[1],
                count,
                resume: 0,
                strip: count.div_ceil(LEAST_STRIPS).clamp(WARP, LONGEST_STRIP),
            };
            self.chunk(stream, stage, (pipeline, geometry), buffers, push)?;
        }
        Ok(())
    }

    fn chunk(
        &self,
        stream: &mut Stream,
        stage: &str,
        (pipeline, geometry): (&Pipeline, &Geometry),
        buffers: &RayBuffers,
        mut push: TracePush,
    ) -> Result<()> {
        // Stands in for buffers that the kernel was compiled not to touch.
        let unused = &self.unfinished;
        let mut bound = vec![
            buffers.rays,
            buffers.hits,
            buffers.counters.unwrap_or(unused),
            &self.travels,
            &self.unfinished,
            &self.next_ray,
            buffers.steps.map_or(unused, |steps| &steps.starts),
        ];
        let mut reached = vec![&geometry.tree];
        if !pipeline.kernel().interface().texels.is_empty() {
            bound.extend(&reached);
        }
        reached.extend(buffers.steps.map(|steps| &steps.words));
        let invocations = match self.dealt {
            Dealt::Each => push.count,
            Dealt::Strips => push.count.div_ceil(push.strip) * WARP,
            Dealt::OnDemand(invocations) => invocations.min(push.count),
        };
        if self.dealt != Dealt::Each {
            stream.fill(&self.next_ray, 0)?;
        }
        loop {
            if self.limited {
                stream.fill(&self.unfinished, 0)?;
            }
            stream.dispatch(stage, pipeline, (&bound, &reached), &push, invocations)?;
            if !self.limited {
                return Ok(());
            }
            stream.finish()?;
            let taken = match self.dealt {
                Dealt::OnDemand(_) => stream.gpu().download::<u32>(&self.next_ray, 0..1)?[0],
                _ => push.count,
            };
            if taken >= push.count && stream.gpu().download::<u32>(&self.unfinished, 0..1)?[0] == 0 {
                return Ok(());
            }
            push.resume = 1;
        }
    }
}
