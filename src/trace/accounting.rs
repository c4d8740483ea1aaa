//! What a migration is held to account for: the sums that must balance in every run, and on request what each
//! SM did.

use derive_more::AddAssign;
use serde::Serialize;

use crate::bvh::Partition;
use crate::layout::{Hit, QueueEntry, Ray, RayCounters, Round, Travel, Visit};
use crate::shared::WARP;
use crate::{Error, Result};

/// Bytes of a ray's record, read whenever it is taken from a queue.
pub const RECORD_BYTES: u64 = (size_of::<Ray>() + size_of::<Hit>() + size_of::<Travel>()) as u64;

/// Bytes of it that are written when the ray goes on to a queue or ends; the ray itself does not change.
pub const RECORD_BYTES_WRITTEN: u64 = (size_of::<Hit>() + size_of::<Travel>()) as u64;

/// A migration from the first ray scheduled to the last one ended.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct MigrationReport {
    /// Rays that were traced; dead ones do not count.
    pub rays: u64,
    /// Rays that ended in the top tree: no queue saw them.
    pub ended_in_top_tree: u64,
    /// One a round.
    pub rounds: Vec<RoundReport>,
    /// One an SM, where counters were asked for.
    pub sms: Vec<SmCounters>,
}

impl MigrationReport {
    /// Adds what became of further rays.
    pub fn append(&mut self, more: MigrationReport) {
        self.rays += more.rays;
        self.ended_in_top_tree += more.ended_in_top_tree;
        self.rounds.extend(more.rounds);
        self.sms.resize(self.sms.len().max(more.sms.len()), SmCounters::default());
        self.sms.iter_mut().zip(more.sms).for_each(|(sum, more)| *sum += more);
    }

    /// Warps and lanes of all SMs.
    pub fn warps(&self) -> WarpCounters {
        let mut sum = WarpCounters::default();
        self.sms.iter().for_each(|sm| sum += sm.warps);
        sum
    }
}

/// Sums over a round.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RoundReport {
    /// Entries in queues when it began.
    pub queued: u64,
    /// Entries taken.
    pub taken: u64,
    /// Entries put in queues for the next round.
    pub pushed: u64,
    /// Rays that ended.
    pub ended: u64,
    /// Queues that were not empty, where counters were asked for.
    pub queues: u64,
    /// Entries of the longest queue, where counters were asked for.
    pub longest_queue: u64,
}

/// What an SM did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, AddAssign)]
pub struct SmCounters {
    /// Rays taken from its queues.
    pub taken: u64,
    /// Rays put in queues, its own among them.
    pub pushed: u64,
    /// Rays that ended.
    pub ended: u64,
    /// Bytes of records read and written.
    pub record_bytes: u64,
    /// What its rays did.
    #[serde(flatten)]
    pub totals: Totals,
    /// Warps and lanes that it took.
    #[serde(flatten)]
    pub warps: WarpCounters,
}

/// Sums of [`RayCounters`], whose fields they are named after.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, AddAssign)]
#[allow(missing_docs, reason = "see RayCounters")]
pub struct Totals {
    pub node_visits: u64,
    pub triangle_tests: u64,
    pub leaf_visits: u64,
    pub stack_operations: u64,
    pub top_visits: u64,
    pub top_stack_operations: u64,
    pub climbs: u64,
    pub subtrees: u64,
    pub migrations: u64,
    pub bypasses: u64,
    pub suspensions: u64,
}

impl Totals {
    /// Adds what one ray did.
    pub fn add(&mut self, ray: &RayCounters) {
        let pairs = [
            (&mut self.node_visits, ray.node_visits),
            (&mut self.triangle_tests, ray.triangle_tests),
            (&mut self.leaf_visits, ray.leaf_visits),
            (&mut self.stack_operations, ray.stack_operations),
            (&mut self.top_visits, ray.top_visits),
            (&mut self.top_stack_operations, ray.top_stack_operations),
            (&mut self.climbs, ray.climbs),
            (&mut self.subtrees, ray.subtrees),
            (&mut self.migrations, ray.migrations),
            (&mut self.bypasses, ray.bypasses),
            (&mut self.suspensions, ray.suspensions),
        ];
        pairs.into_iter().for_each(|(sum, value)| *sum += u64::from(value));
    }

    /// Of all rays.
    pub fn of(counters: &[RayCounters]) -> Totals {
        let mut totals = Totals::default();
        counters.iter().for_each(|ray| totals.add(ray));
        totals
    }
}

/// A warp is 32 consecutive rays in launch or queue order, whatever the device's subgroup is. A step is a node
/// visit or a triangle test; a warp takes as many as the lane that takes the most.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, AddAssign)]
pub struct WarpCounters {
    /// Sum over warps of their steps.
    pub warp_steps: u64,
    /// Sum over warps of the steps of all their lanes.
    pub lane_steps: u64,
}

impl WarpCounters {
    /// Of rays in the order in which they form warps.
    pub fn of<'a>(rays: impl Iterator<Item = &'a RayCounters>) -> WarpCounters {
        let mut warps = WarpCounters::default();
        let mut longest = 0;
        for (lane, ray) in (0..WARP).cycle().zip(rays) {
            let steps = u64::from(ray.node_visits) + u64::from(ray.triangle_tests);
            longest = if lane == 0 { 0 } else { longest };
            warps.warp_steps += steps.saturating_sub(longest);
            warps.lane_steps += steps;
            longest = steps.max(longest);
        }
        warps
    }

    /// Active lanes of a warp step, as a part of all.
    pub fn simd_efficiency(&self) -> f64 {
        self.lane_steps as f64 / (f64::from(WARP) * self.warp_steps.max(1) as f64)
    }
}

/// The books of a migration.
pub struct Account {
    report: MigrationReport,
    in_flight: u64,
    pushed: u64,
    taken: u64,
}

impl Account {
    /// Opens the books with what scheduling did to `count` rays.
    ///
    /// # Errors
    /// [`Error::Check`] if more rays came out than went in.
    pub fn open(count: u32, scheduled: &Round) -> Result<Account> {
        let (pushed, ended) = (u64::from(scheduled.pushed), u64::from(scheduled.ended));
        require(pushed + ended <= u64::from(count), || {
            format!("{count} rays were scheduled, {pushed} queued, {ended} ended")
        })?;
        let report = MigrationReport { rays: pushed + ended, ended_in_top_tree: ended, ..MigrationReport::default() };
        Ok(Account { report, in_flight: pushed, pushed, taken: 0 })
    }

    /// Rays that have not ended.
    pub fn in_flight(&self) -> u64 {
        self.in_flight
    }

    /// Books a round.
    ///
    /// # Errors
    /// [`Error::Check`] with the numbers if rays were lost, doubled or misled, or nothing moved.
    pub fn round(&mut self, sums: &Round) -> Result<()> {
        let [queued, taken, pushed, ended] = [sums.queued, sums.taken, sums.pushed, sums.ended].map(u64::from);
        let number = self.report.rounds.len() + 1;
        let numbers = || format!("round {number}: {queued} queued, {taken} taken, {pushed} pushed, {ended} ended");
        require(queued == self.in_flight, || format!("{}, but {} rays were in flight", numbers(), self.in_flight))?;
        require(sums.faults == 0, || format!("{}, {} records were not where they should be", numbers(), sums.faults))?;
        require(taken == pushed + ended && taken <= queued, || format!("{}: they do not add up", numbers()))?;
        require(queued == 0 || taken > 0, || format!("{}: nothing moves", numbers()))?;
        self.in_flight -= ended;
        self.pushed += pushed;
        self.taken += taken;
        if queued > 0 {
            self.report.rounds.push(RoundReport { queued, taken, pushed, ended, ..RoundReport::default() });
        }
        Ok(())
    }

    /// Adds what each SM did in the round that was booked last, from what became of its queue entries.
    ///
    /// # Errors
    /// [`Error::Check`] if these tell of other numbers of rays than the round's sums.
    pub fn visits(&mut self, partition: &Partition, visits: &[Visit]) -> Result<()> {
        let Some(round) = self.report.rounds.last_mut() else { return Ok(()) };
        let sms = &mut self.report.sms;
        sms.resize(partition.sms() as usize, SmCounters::default());
        let before: Vec<SmCounters> = sms.clone();
        for queue in visits.chunk_by(|a, b| a.subtree == b.subtree) {
            round.queues += 1;
            round.longest_queue = round.longest_queue.max(queue.len() as u64);
        }
        let owner = |visit: &Visit| partition.subtrees[visit.subtree as usize].owner;
        for queues in visits.chunk_by(|a, b| owner(a) == owner(b)) {
            sms[owner(&queues[0]) as usize].add(queues);
        }
        let sum =
            |of: &dyn Fn(&SmCounters) -> u64| sms.iter().map(of).sum::<u64>() - before.iter().map(of).sum::<u64>();
        let (taken, pushed, ended) = (sum(&|sm| sm.taken), sum(&|sm| sm.pushed), sum(&|sm| sm.ended));
        require((taken, pushed, ended) == (round.taken, round.pushed, round.ended), || {
            format!("visits tell of {taken} rays taken, {pushed} pushed and {ended} ended, the round of {round:?}")
        })
    }

    /// Closes the books; with `counters`, those of all rays must be the sums over SMs and scheduling.
    ///
    /// # Errors
    /// [`Error::Check`] with the numbers if anything is left over.
    pub fn close(self, counters: Option<&[RayCounters]>) -> Result<MigrationReport> {
        require(self.in_flight == 0, || format!("{} rays never ended", self.in_flight))?;
        require(self.pushed == self.taken, || format!("{} rays were pushed, {} taken", self.pushed, self.taken))?;
        if let Some(counters) = counters {
            let totals = Totals::of(counters);
            let queued = self.report.rays - self.report.ended_in_top_tree;
            let sum = |of: &dyn Fn(&SmCounters) -> u64| self.report.sms.iter().map(of).sum::<u64>();
            require(totals.subtrees == queued + totals.migrations + totals.bypasses, || {
                format!(
                    "{queued} rays were queued, {} migrated, {} bypassed queues, but {} subtrees were entered",
                    totals.migrations, totals.bypasses, totals.subtrees
                )
            })?;
            require(totals.triangle_tests == sum(&|sm| sm.totals.triangle_tests), || {
                format!(
                    "rays made {} triangle tests, SMs {}",
                    totals.triangle_tests,
                    sum(&|sm| sm.totals.triangle_tests)
                )
            })?;
        }
        Ok(self.report)
    }
}

impl SmCounters {
    /// Adds a round of this SM's queues.
    fn add(&mut self, visits: &[Visit]) {
        for visit in visits.iter().filter(|visit| visit.taken != 0) {
            let is_end = visit.next == crate::shared::LINK_DONE;
            self.taken += 1;
            self.pushed += u64::from(!is_end);
            self.ended += u64::from(is_end);
            self.record_bytes += RECORD_BYTES + RECORD_BYTES_WRITTEN + 2 * size_of::<QueueEntry>() as u64;
            self.totals.add(&visit.counted);
        }
        self.warps += WarpCounters::of(visits.iter().map(|visit| &visit.counted));
    }
}

fn require(holds: bool, otherwise: impl FnOnce() -> String) -> Result<()> {
    if holds { Ok(()) } else { Err(Error::Check(format!("conservation of rays: {}", otherwise()))) }
}
