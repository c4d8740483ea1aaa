//! Rays in, hits out, by any strategy, on the device.

use super::accounting::MigrationReport;
use super::geometry::Geometry;
use super::migrator::{MigrationKernels, Migrator, QUOTA};
use super::options::{NodeFormat, Query, Strategy, TracerOptions};
use super::stream::Stream;
use super::whole_tree::{Dealt, WholeTree};
use crate::Result;
use crate::bvh::Bvh;
use crate::shared::*;
use crate::vulkan::{Buffer, DeviceKind, Gpu, Kernel, Pipeline, Probe};

/// Loop iterations kept free below a driver's limit: leaves met after the last step (a stack of them, 8
/// triangles each), and a stack written to a trail and read back.
const LIMIT_MARGIN: u32 = 1024;

/// Most turns of loops that an invocation takes a step; see `glsl/include/traverse.glsl`.
const TURNS_A_STEP: u32 = 3;

/// Most lanes that a software driver has (lavapipe with vectors of 512 bits).
const CPU_DRIVER_LANES: u32 = 16;

/// Steps of an invocation of which a driver ends loops after `limit` turns, if the lanes of its subgroup take
/// their steps together: a turn of any is a turn of all.
const fn steps_together(limit: u32) -> u32 {
    let steps = limit.saturating_sub(LIMIT_MARGIN) / TURNS_A_STEP;
    if steps > 0 { steps } else { 1 }
}

/// Likewise if each invocation goes through several rays: in the worst case no two lanes take a step at the same
/// time, and each waits for the turns of all others.
pub(super) const fn steps_in_turn(limit: u32) -> u32 {
    let steps = steps_together(limit) / CPU_DRIVER_LANES;
    if steps > 0 { steps } else { 1 }
}

/// Buffers of a batch of rays.
#[derive(Clone, Copy)]
pub struct RayBuffers<'b> {
    /// [`crate::layout::Ray`] each.
    pub rays: &'b Buffer,
    /// [`crate::layout::Hit`] each.
    pub hits: &'b Buffer,
    /// [`crate::layout::RayCounters`] each, if what rays do is to be counted.
    pub counters: Option<&'b Buffer>,
    /// Room for their steps, if these are to be recorded; needs `counters`.
    pub steps: Option<&'b StepBuffers>,
    /// Rays that follow each other go much the same way, as camera rays do. A hint, for speed alone.
    pub coherent: bool,
}

/// Room for a step trace.
pub struct StepBuffers {
    /// Of each ray: address of its words, low word first, or 0 if it is not recorded.
    pub starts: Buffer,
    /// The words.
    pub words: Buffer,
}

/// What a batch of rays needs of a kernel.
#[derive(Clone, Copy, Default)]
pub struct RayFeatures {
    /// See [`RayBuffers::counters`].
    pub count: bool,
    /// See [`RayBuffers::steps`].
    pub record: bool,
    /// See [`RayBuffers::coherent`].
    pub coherent: bool,
}

impl<'b> RayBuffers<'b> {
    /// Hits alone are wanted, of rays that go much the same way.
    pub fn new(rays: &'b Buffer, hits: &'b Buffer) -> RayBuffers<'b> {
        RayBuffers { rays, hits, counters: None, steps: None, coherent: true }
    }

    /// What is asked of a kernel.
    pub fn features(&self) -> RayFeatures {
        RayFeatures { count: self.counters.is_some(), record: self.steps.is_some(), coherent: self.coherent }
    }

    /// Whether rays that follow each other go much the same way.
    pub fn coherent(self, coherent: bool) -> RayBuffers<'b> {
        RayBuffers { coherent, ..self }
    }

    /// Also what rays do.
    pub fn counted(self, counters: &'b Buffer) -> RayBuffers<'b> {
        RayBuffers { counters: Some(counters), ..self }
    }
}

/// The trace kernels, ready for one scene.
pub struct Tracer {
    geometry: Geometry,
    nodes: NodeFormat,
    spec: Vec<(u32, u32)>,
    /// Use the kernels for the lanes of software drivers; see `geometry.glsl` and `traverse.glsl`.
    cpu_lanes: bool,
    plan: Plan,
}

/// What a strategy keeps on the device.
enum Plan {
    Direct(WholeTree),
    Persistent(WholeTree),
    Migrate(Box<Migrator>),
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
    /// Uploads `bvh` and makes room for `most_rays` rays at a time; more are traced in parts.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] for options out of range, [`crate::Error::Device`] if the driver fails.
    pub fn new(gpu: &Gpu, bvh: &Bvh, options: &TracerOptions, most_rays: u32) -> Result<Tracer> {
        let own_limit = match options.strategy {
            Strategy::Direct => gpu.probe().loop_limit.map(steps_together),
            Strategy::Persistent => gpu.probe().loop_limit.map(steps_in_turn),
            Strategy::Migrate => Some(QUOTA),
        };
        let step_limit = options.step_limit.or(own_limit);
        let exact_reciprocal = gpu.probe().exact_reciprocal || options.driver_arithmetic;
        let mut spec = exactness(&Probe { exact_reciprocal, ..*gpu.probe() }).to_vec();
        spec.push((SPEC_STEP_LIMIT, step_limit.unwrap_or(0)));
        options.check()?;
        let machine = &options.machine;
        let most_rays = most_rays.max(1);
        // Before the tree: whether there is room for rays and queues is known at once.
        let migrator = match options.strategy {
            Strategy::Migrate => Some(Box::new(Migrator::new(gpu, bvh, machine, most_rays)?)),
            _ => None,
        };
        let partition = migrator.as_ref().map(|migrator| migrator.partition());
        let geometry = Geometry::upload(gpu, bvh, options.nodes, partition)?;
        let limits = &gpu.info().limits;
        // All of the tree and of any buffer of rays as texels, with distances in bytes of 32 bits.
        let (tree, texels) = (geometry.tree.bytes(), limits.texel_buffer_range);
        let fits = tree.max(limits.storage_buffer_range) <= texels && u32::try_from(tree).is_ok();
        let cpu_lanes = gpu.info().kind == DeviceKind::Cpu && fits && !options.gpu_kernels;
        let whole_tree = |dealt| WholeTree::new(gpu, dealt, step_limit.is_some(), most_rays);
        let plan = match migrator {
            Some(migrator) => Plan::Migrate(migrator),
            None if options.strategy == Strategy::Persistent => {
                Plan::Persistent(whole_tree(Dealt::OnDemand(machine.invocations()))?)
            }
            None if cpu_lanes && step_limit.is_none() => Plan::Direct(whole_tree(Dealt::Strips)?),
            None => Plan::Direct(whole_tree(Dealt::Each)?),
        };
        Ok(Tracer { cpu_lanes, geometry, nodes: options.nodes, spec, plan })
    }

    /// The scene on the device.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// The kernels that a query runs; a device keeps what it has compiled.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the driver fails.
    pub fn pipelines(&self, gpu: &Gpu, query: Query, features: RayFeatures) -> Result<Vec<Pipeline>> {
        let own = [
            (SPEC_ANY_HIT, (query == Query::Any).into()),
            (SPEC_COUNT, features.count.into()),
            (SPEC_RECORD, features.record.into()),
        ];
        let mut spec = [&self.spec[..], &own].concat();
        // Not where nothing depends on it: each value is a kernel to compile.
        if let Plan::Direct(tree) | Plan::Persistent(tree) = &self.plan
            && self.cpu_lanes
            && !tree.limited()
        {
            spec.push((SPEC_COHERENT, features.coherent.into()));
        }
        let lanes = |gpu: Kernel, cpu: Kernel| if self.cpu_lanes { cpu } else { gpu };
        let kernels: &[Kernel] = match &self.plan {
            Plan::Direct(_) => match self.nodes {
                NodeFormat::Full => &[lanes(Kernel::Direct, Kernel::DirectCpu)],
                NodeFormat::Quantised => &[lanes(Kernel::DirectQuantised, Kernel::DirectQuantisedCpu)],
            },
            Plan::Persistent(_) => &[lanes(Kernel::Persistent, Kernel::PersistentCpu)],
            Plan::Migrate(migrator) => {
                spec.extend(migrator.specialization());
                match migrator.asks_hardware() {
                    true => &[Kernel::Schedule, Kernel::MigrateSm],
                    false => {
                        &[lanes(Kernel::Schedule, Kernel::ScheduleCpu), lanes(Kernel::Migrate, Kernel::MigrateCpu)]
                    }
                }
            }
        };
        kernels.iter().map(|&kernel| gpu.pipeline(kernel, &spec)).collect()
    }

    /// Records the tracing of the first `count` rays into `hits` and the other buffers. Where invocations are
    /// limited, and with strategy `migrate`, this also runs the stream, as often as it takes. Strategy
    /// `migrate` reports on it.
    ///
    /// # Errors
    /// [`crate::Error::Device`] naming `stage`; [`crate::Error::Check`] if rays were lost or doubled.
    pub fn trace(
        &self,
        stream: &mut Stream,
        stage: &str,
        query: Query,
        buffers: &RayBuffers,
        count: u32,
    ) -> Result<Option<MigrationReport>> {
        let pipelines = self.pipelines(stream.gpu(), query, buffers.features())?;
        match (&self.plan, &pipelines[..]) {
            (Plan::Direct(tree) | Plan::Persistent(tree), [pipeline]) => {
                tree.trace(stream, stage, (pipeline, &self.geometry), buffers, count)?;
                Ok(None)
            }
            (Plan::Migrate(migrator), [schedule, migrate]) => {
                let kernels = MigrationKernels { schedule: schedule.clone(), migrate: migrate.clone() };
                let most = migrator.most_rays();
                let parts = (0..count).step_by(most as usize).map(|first| (first, most.min(count - first)));
                let mut report = MigrationReport::default();
                for part in parts {
                    report.append(migrator.trace(stream, stage, (&kernels, &self.geometry), buffers, part)?);
                }
                Ok(Some(report))
            }
            _ => unreachable!("a strategy has the kernels that it asked for"),
        }
    }
}
