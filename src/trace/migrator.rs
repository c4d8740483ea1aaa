//! Strategy `migrate` on the device: the partition, the records and the queues there, and the rounds.

use super::accounting::{Account, MigrationReport};
use super::geometry::{Geometry, address};
use super::options::MachineOptions;
use super::stream::Stream;
use super::tracer::RayBuffers;
use crate::bvh::{Bvh, Partition};
use crate::layout::{Batch, MigratePush, Node, QueueEntry, QueuePush, RayCounters, Round, Travel, Visit};
use crate::shared::*;
use crate::vulkan::{Buffer, Gpu, Kernel, Pipeline, Place};
use crate::{Error, Result};

/// Steps of an invocation in a round. Loops take at most three turns a step, so that this stays below 65,535,
/// the strictest limit known of any driver. The same everywhere, because the number of rounds depends on it.
pub const QUOTA: u32 = 20_000;

/// Rounds that the device runs before the host looks whether any ray is left.
const ROUNDS_A_SUBMISSION: u32 = 8;

/// Stage of the kernels that build queues, in reports of time.
const QUEUE_STAGE: &str = "queues";

/// Byte offsets of the arguments of indirect dispatches in a [`Batch`].
const TILES_OFFSET: u64 = std::mem::offset_of!(Batch, tiles) as u64;
const SMS_OFFSET: u64 = std::mem::offset_of!(Batch, sms) as u64;

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
    tables: Tables,
    sort: Sort,
    travels: Buffer,
    batches: Buffer,
    rounds: Buffer,
    /// Entries taken so far from each SM's queues, where SM numbers are the hardware's.
    taken_of_sm: Option<Buffer>,
    /// Where each SM's entries begin in the queue, and where the last one's end.
    shares: Buffer,
    most_rays: u32,
    /// Invocations of an SM.
    lanes: u32,
}

/// The partition on the device.
struct Tables {
    top: Buffer,
    places: Buffer,
    subtrees: Buffer,
    first_of_sm: Buffer,
}

/// The queue sort: entries go back and forth between two buffers.
struct Sort {
    queues: [Buffer; 2],
    counts: Buffer,
    passes: u32,
    count: Pipeline,
    prefix: Pipeline,
    scatter: Pipeline,
    shares: Pipeline,
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
        let entries = u64::from(most_rays) * size_of::<QueueEntry>() as u64;
        let travels = u64::from(most_rays) * size_of::<Travel>() as u64;
        let short = |error: Error| match error {
            Error::Device { stage, problem, .. } => Error::device(
                stage,
                format!("{problem}; records and queues of {most_rays} rays need {} bytes", 2 * entries + travels),
                "use a smaller image, or strategy direct",
            ),
            other => other,
        };
        // A buffer holds at least a node, so that it can be bound.
        let nothing = [Node::default()];
        let top = if partition.top.is_empty() { &nothing[..] } else { &partition.top[..] };
        let bits = u32::BITS - (partition.subtrees.len() as u32).saturating_sub(1).leading_zeros();
        Ok(Migrator {
            tables: Tables {
                top: gpu.upload("top tree", top)?,
                places: gpu.upload("places of the top tree", &partition.top_places)?,
                subtrees: gpu.upload("subtrees", &partition.subtrees)?,
                first_of_sm: gpu.upload("first subtrees", &partition.first_of_sm)?,
            },
            partition,
            sort: Sort {
                queues: [
                    gpu.buffer("queues", entries, Place::Device).map_err(short)?,
                    gpu.buffer("sorted queues", entries, Place::Device).map_err(short)?,
                ],
                counts: gpu.buffer("queue counts", u64::from(DIGITS * MOST_TILES) * 4, Place::Device)?,
                passes: bits.div_ceil(DIGIT_BITS).max(1),
                count: gpu.pipeline(Kernel::QueueCount, &[])?,
                prefix: gpu.pipeline(Kernel::QueuePrefix, &[])?,
                scatter: gpu.pipeline(Kernel::QueueScatter, &[])?,
                shares: gpu.pipeline(Kernel::QueueShares, &[])?,
            },
            travels: gpu.buffer("travels", travels, Place::Device).map_err(short)?,
            batches: gpu.buffer("batches", 2 * size_of::<Batch>() as u64, Place::Device)?,
            rounds: gpu.buffer(
                "rounds",
                u64::from(1 + ROUNDS_A_SUBMISSION) * size_of::<Round>() as u64,
                Place::Device,
            )?,
            taken_of_sm: match machine.hardware_sms {
                true => Some(gpu.buffer("next of each SM", u64::from(machine.sms) * 4, Place::Device)?),
                false => None,
            },
            shares: gpu.buffer("shares", u64::from(machine.sms + 1) * 4, Place::Device)?,
            most_rays,
            lanes: machine.warps_per_sm * WARP,
        })
    }

    /// Most rays at a time.
    pub fn most_rays(&self) -> u32 {
        self.most_rays
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
        stream.fill(&self.rounds, 0)?;
        run.schedule(stream)?;
        let mut account: Option<Account> = None;
        loop {
            // Each round's visits are read before the next overwrites them.
            let rounds = if run.visits.is_some() { 1 } else { ROUNDS_A_SUBMISSION };
            for round in 1..=rounds {
                run.round(stream, round)?;
            }
            stream.finish()?;
            let sums = stream.gpu().download::<Round>(&self.rounds, 0..1 + rounds as usize)?;
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
            stream.fill(&self.rounds, 0)?;
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
        stream.dispatch(self.stage, &self.kernels.schedule, (&buffers, &reached), &push, self.count)
    }

    /// Builds the queues and has every SM go through its own.
    fn round(&mut self, stream: &mut Stream, round: u32) -> Result<()> {
        let Migrator { sort, batches, tables, shares, partition, .. } = self.migrator;
        let mut push = QueuePush { parity: self.parity, shift: 0, round, sms: partition.sms() };
        for pass in 0..sort.passes {
            push.shift = pass * DIGIT_BITS;
            self.sort_pass(stream, push)?;
            self.parity = 1 - self.parity;
            push.parity = self.parity;
        }
        let sorted = [&sort.queues[self.parity as usize], batches, &tables.first_of_sm, shares];
        stream.dispatch(QUEUE_STAGE, &sort.shares, (&sorted, &[]), &push, push.sms + 1)?;
        for cleared in self.visits.iter().chain(&self.migrator.taken_of_sm) {
            stream.fill(cleared, 0)?;
        }
        let (push, buffers, reached) = (self.push(round), self.bound(&self.kernels.migrate), self.reached());
        let groups = (&self.migrator.batches, self.batch_offset() + SMS_OFFSET);
        stream.dispatch_indirect(self.stage, &self.kernels.migrate, (&buffers, &reached), &push, groups)
    }

    /// What became of each entry in the round that ran last. Entries that were not taken wait in the queue as
    /// they were.
    fn read_visits(&self, gpu: &Gpu, visits: &Buffer, queued: u32) -> Result<Vec<Visit>> {
        let queue = &self.migrator.sort.queues[self.parity as usize];
        let entries = gpu.download::<QueueEntry>(queue, 0..queued as usize)?;
        let mut visits = gpu.download::<Visit>(visits, 0..queued as usize)?;
        for (visit, entry) in visits.iter_mut().zip(entries).filter(|(visit, _)| visit.taken == 0) {
            *visit = Visit::waiting(entry);
        }
        Ok(visits)
    }

    fn sort_pass(&self, stream: &mut Stream, push: QueuePush) -> Result<()> {
        let Migrator { sort, batches, rounds, .. } = self.migrator;
        let (from, to) = (&sort.queues[push.parity as usize], &sort.queues[1 - push.parity as usize]);
        let tiles = (batches, self.batch_offset() + TILES_OFFSET);
        stream.dispatch_indirect(QUEUE_STAGE, &sort.count, (&[from, &sort.counts, batches], &[]), &push, tiles)?;
        stream.dispatch(QUEUE_STAGE, &sort.prefix, (&[&sort.counts, batches, rounds], &[]), &push, 1)?;
        stream.dispatch_indirect(QUEUE_STAGE, &sort.scatter, (&[from, &sort.counts, batches, to], &[]), &push, tiles)
    }

    fn batch_offset(&self) -> u64 {
        u64::from(self.parity) * size_of::<Batch>() as u64
    }

    fn push(&self, round: u32) -> MigratePush {
        let tables = &self.migrator.tables;
        MigratePush {
            nodes: address(&self.geometry.nodes),
            triangles: address(&self.geometry.triangles),
            scene_low: self.geometry.bounds[0],
            first: self.first,
            scene_high: self.geometry.bounds[1],
            count: self.count,
            top: address(&tables.top),
            places: address(&tables.places),
            subtrees: address(&tables.subtrees),
            shares: address(&self.migrator.shares),
            visits: self.visits.as_ref().map_or([0; 2], address),
            taken_of_sm: self.migrator.taken_of_sm.as_ref().map_or([0; 2], address),
            root: self.migrator.partition.root,
            round,
            parity: self.parity,
            sms: self.migrator.partition.sms(),
            lanes: self.migrator.lanes,
        }
    }

    fn bound(&self, pipeline: &Pipeline) -> Vec<&Buffer> {
        let Migrator { travels, batches, rounds, sort, .. } = self.migrator;
        let buffers = self.buffers;
        // Stands in for buffers that the kernels were compiled not to touch.
        let unused = batches;
        let mut bound = vec![
            buffers.rays,
            buffers.hits,
            buffers.counters.unwrap_or(unused),
            travels,
            &sort.queues[self.parity as usize],
            batches,
            rounds,
            buffers.steps.map_or(unused, |steps| &steps.starts),
        ];
        if pipeline.kernel().interface().texels > 0 {
            bound.extend([&self.geometry.nodes, &self.geometry.triangles, &self.migrator.tables.top]);
        }
        bound
    }

    fn reached(&self) -> Vec<&Buffer> {
        let tables = &self.migrator.tables;
        let mut reached = vec![
            &self.geometry.nodes,
            &self.geometry.triangles,
            &tables.top,
            &tables.places,
            &tables.subtrees,
            &self.migrator.shares,
        ];
        reached.extend(&self.visits);
        reached.extend(&self.migrator.taken_of_sm);
        reached.extend(self.buffers.steps.map(|steps| &steps.words));
        reached
    }
}
