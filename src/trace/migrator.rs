//! Strategy `migrate` on the device: the partition, the records and the queues there, and the rounds.

use super::accounting::{Account, MigrationReport};
use super::geometry::{Geometry, address};
use super::options::MachineOptions;
use super::queues::Queues;
use super::stream::Stream;
use super::tracer::{RayBuffers, steps_in_turn};
use crate::bvh::{Bvh, Partition};
use crate::layout::{MigratePush, QueueEntry, RayCounters, Round, Travel, Visit};
use crate::shared::*;
use crate::vulkan::{Buffer, Gpu, Pipeline, Place};
use crate::{Error, Result};

/// Steps of an invocation in a round: what every invocation of a subgroup can take one after the other below
/// 65,535 turns, the strictest limit known of any driver. The same everywhere, because the number of rounds
/// depends on it.
pub const QUOTA: u32 = steps_in_turn(65_535);

/// Rounds that the device runs before the host looks whether any ray is left.
const ROUNDS_A_SUBMISSION: u32 = 8;

/// Stage of the first walk of the top tree in reports of time.
const SCHEDULE_STAGE: &str = "schedule";

/// The kernels of a query.
pub struct MigrationKernels {
    /// First walk of the top tree.
    pub schedule: Pipeline,
    /// Rays at their SMs.
    pub migrate: Pipeline,
}

/// Partition, records and queues for a number of rays.
pub struct Migrator {
    partition: Partition,
    /// Of each node of the top tree: its index in the whole tree.
    places: Buffer,
    queues: Queues,
    travels: Buffer,
    /// Entries taken so far from each SM's queues, where SM numbers are the hardware's.
    taken_of_sm: Option<Buffer>,
    most_rays: u32,
    /// Invocations of an SM.
    lanes: u32,
}

impl Migrator {
    /// Cuts `bvh` and makes room for `most_rays` rays at a time: a ray is in at most one queue, so that no
    /// queue can overflow.
    ///
    /// # Errors
    /// [`Error::Usage`] for options out of range; [`Error::Device`] with the bytes needed if memory is short.
    pub fn new(gpu: &Gpu, bvh: &Bvh, machine: &MachineOptions, most_rays: u32) -> Result<Migrator> {
        machine.check_device(gpu.info())?;
        let partition = Partition::new(bvh, machine.partition, machine.owners, machine.sms)?;
        let travels = u64::from(most_rays) * size_of::<Travel>() as u64;
        let short = |error: Error| match error {
            Error::Device { stage, problem, .. } => Error::device(
                stage,
                format!(
                    "{problem}; records and queues of {most_rays} rays need {} bytes",
                    travels + Queues::bytes(most_rays)
                ),
                "use a smaller image, or strategy direct",
            ),
            other => other,
        };
        Ok(Migrator {
            places: gpu.upload("places of the top tree", &partition.top_places)?,
            queues: Queues::new(gpu, &partition, most_rays, ROUNDS_A_SUBMISSION).map_err(short)?,
            partition,
            travels: gpu.buffer("travels", travels, Place::Device).map_err(short)?,
            taken_of_sm: match machine.hardware_sms {
                true => Some(gpu.buffer("entries taken", u64::from(machine.sms) * 4, Place::Device)?),
                false => None,
            },
            most_rays,
            lanes: machine.warps_per_sm * WARP,
        })
    }

    /// How the tree is cut.
    pub fn partition(&self) -> &Partition {
        &self.partition
    }

    /// Most rays at a time.
    pub fn most_rays(&self) -> u32 {
        self.most_rays
    }

    /// Specialization constants of both kernels.
    pub fn specialization(&self) -> [(u32, u32); 2] {
        [(SPEC_WORKGROUP, self.lanes), self.queues.least_strip]
    }

    /// Whether SM numbers are the hardware's.
    pub fn asks_hardware(&self) -> bool {
        self.taken_of_sm.is_some()
    }

    /// Traces rays `first..first + count`, which are at most [`Migrator::most_rays`], to the end.
    ///
    /// # Errors
    /// [`Error::Device`] naming `stage`; [`Error::Check`] if the books do not balance.
    pub fn trace(
        &self,
        stream: &mut Stream,
        stage: &str,
        (kernels, geometry): (&MigrationKernels, &Geometry),
        buffers: &RayBuffers,
        (first, count): (u32, u32),
    ) -> Result<MigrationReport> {
        let visits = match buffers.counters {
            Some(_) => {
                Some(stream.gpu().buffer("visits", u64::from(count) * size_of::<Visit>() as u64, Place::Device)?)
            }
            None => None,
        };
        let mut run = Run { migrator: self, stage, kernels, geometry, buffers, visits, first, count, parity: 0 };
        stream.fill(&self.queues.rounds, 0)?;
        run.schedule(stream)?;
        let mut account: Option<Account> = None;
        loop {
            // Each round's visits are read before the next overwrites them.
            let rounds = if run.visits.is_some() { 1 } else { ROUNDS_A_SUBMISSION };
            for round in 1..=rounds {
                run.round(stream, round)?;
            }
            stream.finish()?;
            let sums = stream.gpu().download::<Round>(&self.queues.rounds, 0..1 + rounds as usize)?;
            let account = match &mut account {
                Some(account) => account,
                None => account.insert(Account::open(count, &sums[0])?),
            };
            for sums in &sums[1..] {
                account.round(sums)?;
                if let Some(visits) = run.visits.as_ref().filter(|_| sums.queued > 0) {
                    account.visits(&self.partition, &run.read_visits(stream.gpu(), visits, sums.queued)?)?;
                }
            }
            if account.in_flight() == 0 {
                break;
            }
            stream.fill(&self.queues.rounds, 0)?;
        }
        let range = first as usize..(first + count) as usize;
        let counters = match buffers.counters {
            Some(counters) => Some(stream.gpu().download::<RayCounters>(counters, range)?),
            None => None,
        };
        account.map_or(Ok(MigrationReport::default()), |account| account.close(counters.as_deref()))
    }
}

/// Rays on their way through a [`Migrator`].
struct Run<'a> {
    migrator: &'a Migrator,
    stage: &'a str,
    kernels: &'a MigrationKernels,
    geometry: &'a Geometry,
    buffers: &'a RayBuffers<'a>,
    visits: Option<Buffer>,
    first: u32,
    count: u32,
    /// Which of the two batches and queue buffers is current.
    parity: u32,
}

impl Run<'_> {
    fn schedule(&self, stream: &mut Stream) -> Result<()> {
        let (push, buffers, reached) = (self.push(0), self.bound(&self.kernels.schedule), self.reached());
        stream.dispatch(SCHEDULE_STAGE, &self.kernels.schedule, (&buffers, &reached), &push, self.count)
    }

    /// Builds the queues and has every SM go through its own.
    fn round(&mut self, stream: &mut Stream, round: u32) -> Result<()> {
        self.parity = self.migrator.queues.sort(stream, round, self.parity)?;
        for cleared in self.visits.iter().chain(&self.migrator.taken_of_sm) {
            stream.fill(cleared, 0)?;
        }
        let (push, buffers, reached) = (self.push(round), self.bound(&self.kernels.migrate), self.reached());
        let groups = self.migrator.queues.sm_groups(self.parity);
        stream.dispatch_indirect(self.stage, &self.kernels.migrate, (&buffers, &reached), &push, groups)
    }

    /// What became of each entry in the round that ran last. Entries that were not taken wait in the queue as
    /// they were.
    fn read_visits(&self, gpu: &Gpu, visits: &Buffer, queued: u32) -> Result<Vec<Visit>> {
        let queue = self.migrator.queues.entries(self.parity);
        let entries = gpu.download::<QueueEntry>(queue, 0..queued as usize)?;
        let mut visits = gpu.download::<Visit>(visits, 0..queued as usize)?;
        for (visit, entry) in visits.iter_mut().zip(entries).filter(|(visit, _)| visit.taken == 0) {
            *visit = Visit::waiting(entry);
        }
        Ok(visits)
    }

    fn push(&self, round: u32) -> MigratePush {
        let Migrator { partition, .. } = self.migrator;
        MigratePush {
            nodes: self.geometry.nodes(),
            triangles: self.geometry.triangles(),
            scene_low: self.geometry.bounds[0],
            first: self.first,
            scene_high: self.geometry.bounds[1],
            count: self.count,
            places: address(&self.migrator.places),
            subtrees: self.geometry.subtrees(),
            shares: address(&self.migrator.queues.shares),
            visits: self.visits.as_ref().map_or([0; 2], address),
            taken_of_sm: self.migrator.taken_of_sm.as_ref().map_or([0; 2], address),
            first_top: self.geometry.first_top,
            root: self.geometry.top_link(partition.root),
            round,
            parity: self.parity,
            sms: partition.sms(),
            lanes: self.migrator.lanes,
        }
    }

    fn bound(&self, pipeline: &Pipeline) -> Vec<&Buffer> {
        let Migrator { travels, queues, .. } = self.migrator;
        let buffers = self.buffers;
        // Stands in for buffers that the kernels were compiled not to touch.
        let unused = &queues.batches;
        let mut bound = vec![
            buffers.rays,
            buffers.hits,
            buffers.counters.unwrap_or(unused),
            travels,
            queues.entries(self.parity),
            &queues.batches,
            &queues.rounds,
            buffers.steps.map_or(unused, |steps| &steps.starts),
        ];
        // Read as texels, by kernels that do.
        let texels = [&self.geometry.tree, buffers.hits, travels];
        let more = pipeline.kernel().interface().bindings as usize - bound.len();
        bound.extend(&texels[..more]);
        bound
    }

    fn reached(&self) -> Vec<&Buffer> {
        let mut reached = vec![&self.geometry.tree, &self.migrator.places, &self.migrator.queues.shares];
        reached.extend(&self.visits);
        reached.extend(&self.migrator.taken_of_sm);
        reached.extend(self.buffers.steps.map(|steps| &steps.words));
        reached
    }
}
