//! Rays in, hits out, by any strategy, on the CPU twins.

use super::accounting::{Account, MigrationReport};
use super::migrator::QUOTA;
use super::options::{Query, Strategy, TracerOptions};
use crate::Result;
use crate::bvh::{Bvh, Partition};
use crate::layout::{Hit, Ray, RayCounters, Round, Visit};
use crate::shared::LINK_DONE;
use crate::twin::migrate::{Machine, Migration};
use crate::twin::trace::{trace_any, trace_closest};

/// The twins, ready for one scene.
pub struct TwinTracer<'a> {
    bvh: &'a Bvh,
    /// The partition and warps of an SM of strategy `migrate`.
    machine: Option<(Partition, u32)>,
    quota: u32,
}

/// What became of a batch of rays.
pub struct Traced {
    /// One a ray.
    pub hits: Vec<Hit>,
    /// One a ray.
    pub counters: Vec<RayCounters>,
    /// Of strategy `migrate`.
    pub migration: Option<MigrationReport>,
}

impl<'a> TwinTracer<'a> {
    /// Cuts the tree if the strategy needs it.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] for options out of range.
    pub fn new(bvh: &'a Bvh, options: &TracerOptions) -> Result<TwinTracer<'a>> {
        let machine = &options.machine;
        machine.check()?;
        let machine = match options.strategy {
            Strategy::Migrate => {
                Some((Partition::new(bvh, machine.partition, machine.owners, machine.sms)?, machine.warps_per_sm))
            }
            Strategy::Direct | Strategy::Persistent => None,
        };
        Ok(TwinTracer { bvh, machine, quota: options.step_limit.unwrap_or(QUOTA) })
    }

    /// Traces `rays` to the end.
    ///
    /// # Errors
    /// [`crate::Error::Check`] if rays were lost or doubled.
    pub fn trace(&self, query: Query, rays: &[Ray]) -> Result<Traced> {
        match (&self.machine, query) {
            (Some((partition, warps)), _) => self.migrate(partition, *warps, query, rays),
            (None, Query::Closest) => Ok(whole(trace_closest(self.bvh, rays))),
            (None, Query::Any) => Ok(whole(trace_any(self.bvh, rays))),
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
        Ok(Traced { hits: migration.hits, counters: migration.counters, migration: Some(report) })
    }
}

fn whole((hits, counters): (Vec<Hit>, Vec<RayCounters>)) -> Traced {
    Traced { hits, counters, migration: None }
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
