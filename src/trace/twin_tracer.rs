//! Rays in, hits out, by any strategy, on the CPU twins.

use super::accounting::{Account, MigrationReport};
use super::migrator::QUOTA;
use super::options::{NodeFormat, Query, Strategy, TracerOptions};
use super::step_sample::StepSample;
use crate::Result;
use crate::bvh::{Bvh, Partition, QuantisedBvh};
use crate::layout::{Hit, Ray, RayCounters, Round, Visit};
use crate::shared::LINK_DONE;
use crate::twin::migrate::{Machine, Migration};
use crate::twin::trace::{trace_any, trace_closest};
use crate::twin::traverse::Tree;

/// The twins, ready for one scene.
pub struct TwinTracer<'a> {
    bvh: &'a Bvh,
    plan: Plan<'a>,
    quota: u32,
}

/// What a strategy goes by.
enum Plan<'a> {
    Full,
    Quantised(QuantisedBvh<'a>),
    /// The partition and warps of an SM.
    Migrate(Partition, u32),
}

/// What became of a batch of rays.
pub struct Traced {
    /// One a ray.
    pub hits: Vec<Hit>,
    /// One a ray.
    pub counters: Vec<RayCounters>,
    /// Of strategy `migrate`.
    pub migration: Option<MigrationReport>,
    /// Invocations of kernels as the driver counted them, of a device that does.
    pub invocations: Option<u64>,
}

impl<'a> TwinTracer<'a> {
    /// Cuts the tree if the strategy needs it.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] for options out of range.
    pub fn new(bvh: &'a Bvh, options: &TracerOptions) -> Result<TwinTracer<'a>> {
        options.check()?;
        let machine = &options.machine;
        let plan = match (options.strategy, options.nodes) {
            (Strategy::Migrate, _) => {
                let partition = Partition::new(bvh, machine.partition, machine.owners, machine.sms)?;
                Plan::Migrate(partition, machine.warps_per_sm)
            }
            (_, NodeFormat::Quantised) => Plan::Quantised(QuantisedBvh::new(bvh)),
            (_, NodeFormat::Full) => Plan::Full,
        };
        Ok(TwinTracer { bvh, plan, quota: options.step_limit.unwrap_or(QUOTA) })
    }

    /// Traces `rays` to the end.
    ///
    /// # Errors
    /// [`crate::Error::Check`] if rays were lost or doubled.
    pub fn trace(&self, query: Query, rays: &[Ray]) -> Result<Traced> {
        match &self.plan {
            Plan::Full => Ok(whole(self.bvh, query, rays)),
            Plan::Quantised(tree) => Ok(whole(tree, query, rays)),
            Plan::Migrate(partition, warps) => self.migrate(partition, *warps, query, rays),
        }
    }

    /// Records the steps of the rays `which`; those of strategy `migrate` are those of the whole tree.
    pub fn record(&self, query: Query, rays: &[Ray], which: Vec<u64>) -> StepSample {
        match &self.plan {
            Plan::Quantised(tree) => StepSample::by_twin(tree, query, rays, which),
            Plan::Full | Plan::Migrate(..) => StepSample::by_twin(self.bvh, query, rays, which),
        }
    }

    fn migrate(&self, partition: &Partition, warps_per_sm: u32, query: Query, rays: &[Ray]) -> Result<Traced> {
        let machine = Machine { bvh: self.bvh, partition, warps_per_sm, quota: self.quota };
        let mut migration = Migration::<()>::schedule(machine, rays);
        let pushed = migration.queued() as u32;
        let live = rays.iter().filter(|ray| ray.is_live()).count() as u32;
        let mut account =
            Account::open(rays.len() as u32, &Round { pushed, ended: live - pushed, ..Round::default() })?;
        while account.in_flight() > 0 {
            let visits = match query {
                Query::Closest => migration.round::<false>(),
                Query::Any => migration.round::<true>(),
            };
            account.round(&sums(&visits))?;
            account.visits(partition, &visits)?;
        }
        let report = account.close(Some(&migration.counters))?;
        Ok(Traced { hits: migration.hits, counters: migration.counters, migration: Some(report), invocations: None })
    }
}

fn whole(tree: &impl Tree, query: Query, rays: &[Ray]) -> Traced {
    let (hits, counters) = match query {
        Query::Closest => trace_closest(tree, rays),
        Query::Any => trace_any(tree, rays),
    };
    Traced { hits, counters, migration: None, invocations: None }
}

fn sums(visits: &[Visit]) -> Round {
    let count = |which: &dyn Fn(&Visit) -> bool| visits.iter().filter(|visit| which(visit)).count() as u32;
    Round {
        queued: visits.len() as u32,
        taken: count(&|visit| visit.taken != 0),
        pushed: count(&|visit| visit.taken != 0 && visit.next != LINK_DONE),
        ended: count(&|visit| visit.next == LINK_DONE),
        ..Round::default()
    }
}
