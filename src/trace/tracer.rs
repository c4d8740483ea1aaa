//! Strategy `direct` on the device: one invocation a ray, the whole tree.

use super::geometry::{Geometry, address};
use super::stream::Stream;
use crate::Result;
use crate::layout::TracePush;
use crate::shared::*;
use crate::vulkan::{Buffer, DeviceKind, Gpu, Kernel, Pipeline, Place, Probe};

/// Loop iterations kept free below a driver's limit: a leaf, and a stack loaded and stored.
const LIMIT_MARGIN: u32 = 512;

/// Rays of a dispatch that can be suspended: bounds the memory for their stacks to 17 MB.
const SUSPENDABLE: u32 = 1 << 16;

/// What is asked of each ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Query {
    /// The nearest hit.
    Closest,
    /// Whether there is any.
    Any,
}

/// How to trace.
#[derive(Clone, Copy, Debug, Default)]
pub struct TracerOptions {
    /// Take the driver's reciprocal as it is, exact or not: what bit identity costs, for benchmarks.
    pub driver_arithmetic: bool,
    /// Stop each invocation after about so many loop iterations and go on in another dispatch. Set by
    /// itself where the driver needs it.
    pub step_limit: Option<u32>,
    /// Use the kernels for GPUs on software drivers too: lets tests run both there.
    pub gpu_kernels: bool,
}

/// The trace kernels, ready for one scene.
pub struct Tracer {
    geometry: Geometry,
    spec: Vec<(u32, u32)>,
    /// Use the kernels for the lanes of software drivers; see `geometry.glsl` and `traverse.glsl`.
    cpu_lanes: bool,
    suspension: Option<Suspension>,
    /// Stands in for buffers that the kernels were compiled not to touch.
    unused: Buffer,
    chunk: u32,
}

/// Where suspended rays wait.
struct Suspension {
    cursors: Buffer,
    unfinished: Buffer,
}

/// Specialization constants for exact arithmetic on a device.
pub fn exactness(probe: &Probe) -> [(u32, u32); 3] {
    [
        (SPEC_RCP_EXACT, probe.exact_reciprocal.into()),
        (SPEC_SQRT_EXACT, probe.exact_sqrt.into()),
        (SPEC_FMA_FUSED, probe.fma_fused.into()),
    ]
}

impl Tracer {
    /// Compiles the kernels for `geometry`.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the driver fails.
    pub fn new(gpu: &Gpu, geometry: Geometry, options: TracerOptions) -> Result<Tracer> {
        let driver_limit = gpu.probe().loop_limit.map(|limit| limit.saturating_sub(LIMIT_MARGIN).max(1));
        let step_limit = options.step_limit.or(driver_limit);
        let mut spec = exactness(gpu.probe()).to_vec();
        if options.driver_arithmetic {
            spec[0] = (SPEC_RCP_EXACT, 1);
        }
        spec.push((SPEC_STEP_LIMIT, step_limit.unwrap_or(0)));
        let most = gpu.info().limits.groups.saturating_mul(WARP);
        let chunk = if step_limit.is_some() { most.min(SUSPENDABLE) } else { most };
        let suspension = step_limit.map(|_| Suspension::new(gpu)).transpose()?;
        let texels = gpu.info().limits.texel_buffer_range;
        let fits = geometry.nodes.bytes().max(geometry.triangles.bytes()) <= texels;
        let cpu_lanes = gpu.info().kind == DeviceKind::Cpu && fits && !options.gpu_kernels;
        let unused = gpu.buffer("unused", 16, Place::Device)?;
        Ok(Tracer { geometry, spec, cpu_lanes, suspension, unused, chunk })
    }

    /// The scene on the device.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// The kernel for a query; a device keeps what it has compiled.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the driver fails.
    pub fn pipeline(&self, gpu: &Gpu, query: Query, count: bool) -> Result<Pipeline> {
        let kernel = match query {
            Query::Closest if self.cpu_lanes => Kernel::TraceClosestCpu,
            Query::Any if self.cpu_lanes => Kernel::TraceAnyCpu,
            Query::Closest => Kernel::TraceClosest,
            Query::Any => Kernel::TraceAny,
        };
        gpu.pipeline(kernel, &[&self.spec[..], &[(SPEC_COUNT, count.into())]].concat())
    }

    /// Records the tracing of `rays[..count]` into `hits` and, if there is a buffer for them, what each ray
    /// did into `counters`. Where invocations are limited this also runs the stream, as often as it takes.
    ///
    /// # Errors
    /// [`crate::Error::Device`] naming `stage`.
    pub fn trace(
        &self,
        stream: &mut Stream,
        stage: &str,
        query: Query,
        (rays, hits, counters): (&Buffer, &Buffer, Option<&Buffer>),
        count: u32,
    ) -> Result<()> {
        let pipeline = self.pipeline(stream.gpu(), query, counters.is_some())?;
        let (cursors, unfinished) = match &self.suspension {
            Some(suspension) => (&suspension.cursors, &suspension.unfinished),
            None => (&self.unused, &self.unused),
        };
        let reached = [&self.geometry.nodes, &self.geometry.triangles];
        let mut buffers = vec![rays, hits, counters.unwrap_or(&self.unused), cursors, unfinished];
        if self.cpu_lanes {
            buffers.extend(reached);
        }
        for first in (0..count).step_by(self.chunk as usize) {
            let mut push = TracePush {
                nodes: address(&self.geometry.nodes),
                triangles: address(&self.geometry.triangles),
                scene_low: self.geometry.bounds[0],
                first,
                scene_high: self.geometry.bounds[1],
                count: self.chunk.min(count - first),
                resume: 0,
            };
            loop {
                if self.suspension.is_some() {
                    stream.fill(unfinished, 0)?;
                }
                stream.dispatch(stage, &pipeline, (&buffers, &reached), &push, push.count)?;
                let Some(suspension) = &self.suspension else { break };
                stream.finish()?;
                if stream.gpu().download::<u32>(&suspension.unfinished, 0..1)?[0] == 0 {
                    break;
                }
                push.resume = 1;
            }
        }
        Ok(())
    }
}

impl Suspension {
    fn new(gpu: &Gpu) -> Result<Suspension> {
        // A link, a depth and a stack for each ray.
        let words = u64::from(STACK_SIZE + 2) * u64::from(SUSPENDABLE);
        Ok(Suspension {
            cursors: gpu.buffer("suspended rays", words * 4, Place::Device)?,
            unfinished: gpu.buffer("unfinished rays", 4, Place::Device)?,
        })
    }
}
