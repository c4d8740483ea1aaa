//! Strategies `direct` and `persistent` on the device: each ray's way through the whole tree at a stretch,
//! unless the driver makes invocations stop.

use super::geometry::{Geometry, address};
use super::stream::Stream;
use super::tracer::RayBuffers;
use crate::Result;
use crate::layout::{TracePush, Travel};
use crate::shared::WARP;
use crate::vulkan::{Buffer, Gpu, Pipeline, Place};

/// Rays of a dispatch of `direct` that can be suspended: bounds the memory for their places to 16 MiB.
const SUSPENDABLE: u32 = 1 << 20;

/// How rays are given to invocations, and where suspended ones wait.
pub struct WholeTree {
    /// Invocations of strategy `persistent`; `direct` has one a ray.
    invocations: Option<u32>,
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
    pub fn new(gpu: &Gpu, invocations: Option<u32>, limited: bool, most_rays: u32) -> Result<WholeTree> {
        let most = gpu.info().limits.groups.saturating_mul(WARP);
        let chunk = match invocations {
            Some(_) => i32::MAX as u32,
            None if limited => most.min(SUSPENDABLE).min(most_rays),
            None => most,
        };
        let suspended = if limited { u64::from(invocations.unwrap_or(chunk)) } else { 0 };
        Ok(WholeTree {
            invocations,
            chunk,
            limited,
            travels: gpu.buffer("suspended rays", suspended * size_of::<Travel>() as u64, Place::Device)?,
            unfinished: gpu.buffer("unfinished rays", 4, Place::Device)?,
            next_ray: gpu.buffer("next ray", 4, Place::Device)?,
        })
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
            let push = TracePush {
                nodes: address(&geometry.nodes),
                triangles: address(&geometry.triangles),
                scene_low: geometry.bounds[0],
                first,
                scene_high: geometry.bounds[1],
                count: self.chunk.min(count - first),
                resume: 0,
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
        let mut reached = vec![&geometry.nodes, &geometry.triangles];
        if pipeline.kernel().interface().texels > 0 {
            bound.extend(&reached);
        }
        reached.extend(buffers.steps.map(|steps| &steps.words));
        let invocations = self.invocations.unwrap_or(push.count).min(push.count);
        if self.invocations.is_some() {
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
            let taken = match self.invocations {
                Some(_) => stream.gpu().download::<u32>(&self.next_ray, 0..1)?[0],
                None => push.count,
            };
            if taken >= push.count && stream.gpu().download::<u32>(&self.unfinished, 0..1)?[0] == 0 {
                return Ok(());
            }
            push.resume = 1;
        }
    }
}
