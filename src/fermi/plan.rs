//! Strategies as launches of kernels.

use super::cut::{Cut, Home};
use super::kernel::Kernel;
use super::launch::{Launch, Stage, Visit, Work, Workload};
use super::sort::{self, Kind, Pass};
use crate::trace::Digits;

/// Which rays run together where subtrees have virtual caches and queues are free. The paper leaves it open.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Grouping {
    /// Rays stay in the warps in which they were launched: only the caches change.
    #[default]
    Launched,
    /// Rays of a subtree's queue, on any multiprocessor.
    Queued,
    /// Rays of a subtree's queue, on the multiprocessor that owns the subtree.
    Owned,
}

/// Rays in the queues of a round.
#[derive(Clone, Debug)]
struct Round {
    /// Entries that the round before left, those of rays that ended among them.
    entries: usize,
    /// Places of the entries after each pass of the sort.
    passes: Vec<Vec<u32>>,
    /// The sorted queue.
    queue: Vec<Visit>,
    /// First entry of each owner, and the end.
    owners: Vec<u32>,
}

/// What becomes of all rays under strategy `migrate`.
#[derive(Clone, Debug)]
pub struct Migration {
    /// Digits of the sort.
    digits: Digits,
    rounds: Vec<Round>,
}

/// Place of an entry that the sort leaves out.
pub const LEFT_OUT: u32 = u32::MAX;

impl Migration {
    /// Follows the rays of `workload` through queues. With `bypass`, a ray goes on at once to subtrees of the same
    /// owner. No quota of steps ends a round: a ray's stay is never cut short.
    pub fn of(workload: &Workload, cut: &Cut, bypass: bool) -> Migration {
        let mut standing: Vec<Option<Visit>> =
            (0..workload.trace.rays() as u32).map(|ray| next_visit(workload, cut, ray, 0, bypass)).collect();
        let mut migration = Migration { digits: Digits::of(cut.subtrees().len()), rounds: Vec::new() };
        while standing.iter().any(Option::is_some) {
            let round = Round::of(&standing, cut, migration.digits);
            standing = round
                .queue
                .iter()
                .map(|visit| next_visit(workload, cut, visit.ray, visit.steps.1 as usize, bypass))
                .collect();
            migration.rounds.push(round);
        }
        migration
    }

    /// Entries of queues in all rounds.
    pub fn entries(&self) -> usize {
        self.rounds.iter().map(|round| round.queue.len()).sum()
    }

    /// Launches of strategy `migrate`, everything charged.
    pub fn launches<'a>(&'a self, workload: Workload<'a>, kernels: &'a Kernels) -> Vec<Launch<'a>> {
        let launch = |kernel, stage, work| Launch { kernel, workload, work, virtual_caches: false, stage };
        let digits = self.digits.values() as usize;
        let mut all = vec![launch(&kernels.schedule, Stage::Schedule, Work::Schedule)];
        for round in &self.rounds {
            let sms = round.owners.len() as u32 - 1;
            let mut entries = round.entries;
            for places in &round.passes {
                for kind in [Kind::Count, Kind::Prefix, Kind::Scatter] {
                    let work = Work::Sort(Pass { kind, entries, sms, digits, places });
                    all.push(launch(&kernels.queue, Stage::Queue, work));
                }
                entries = round.queue.len();
            }
            let shares = Work::Sort(Pass { kind: Kind::Shares, entries, sms, digits, places: &[] });
            all.push(launch(&kernels.queue, Stage::Queue, shares));
            let work = Work::Visits { queue: &round.queue, blocks: &round.owners, charged: true };
            all.push(launch(&kernels.subtree, Stage::Traverse, work));
        }
        all
    }
}

/// The kernels of strategy `migrate`.
#[derive(Clone, Debug)]
pub struct Kernels {
    /// First walk of the top tree.
    pub schedule: Kernel,
    /// Making queues.
    pub queue: Kernel,
    /// Subtrees.
    pub subtree: Kernel,
}

/// Visits of single subtrees with nothing else charged, in one launch: the paper's traversal stage.
#[derive(Clone, Debug)]
pub struct FreeVisits {
    queue: Vec<Visit>,
    blocks: Vec<u32>,
}

impl FreeVisits {
    /// Of `workload`: by subtree, and among those of a subtree first the rays that come to it first. `threads` a
    /// block.
    pub fn of(workload: &Workload, cut: &Cut, grouping: Grouping, threads: u32) -> FreeVisits {
        let migration = Migration::of(workload, cut, false);
        let mut queue: Vec<Visit> = migration.rounds.into_iter().flat_map(|round| round.queue).collect();
        queue.sort_by_key(|visit| visit.subtree);
        let end = queue.len() as u32;
        let blocks = match grouping {
            Grouping::Owned => first_of_owners(&queue, cut),
            Grouping::Queued | Grouping::Launched => (0..end).step_by(threads as usize).chain([end]).collect(),
        };
        FreeVisits { queue, blocks }
    }

    /// The launch.
    pub fn launch<'a>(&'a self, workload: Workload<'a>, kernel: &'a Kernel) -> Launch<'a> {
        let work = Work::Visits { queue: &self.queue, blocks: &self.blocks, charged: false };
        Launch { kernel, workload, work, virtual_caches: true, stage: Stage::Traverse }
    }
}

impl Round {
    fn of(standing: &[Option<Visit>], cut: &Cut, digits: Digits) -> Round {
        let mut queue: Vec<Option<Visit>> = standing.to_vec();
        let mut passes = Vec::new();
        for pass in 0..digits.passes {
            let moving: Vec<Visit> = queue.iter().copied().flatten().collect();
            let mut order = sort::places(moving.iter().map(|visit| visit.subtree), digits, pass).into_iter();
            let places: Vec<u32> =
                queue.iter().map(|entry| entry.and_then(|_| order.next()).unwrap_or(LEFT_OUT)).collect();
            let mut sorted = vec![None; moving.len()];
            for (entry, &place) in queue.iter().zip(&places).filter(|(entry, _)| entry.is_some()) {
                sorted[place as usize] = *entry;
            }
            passes.push(places);
            queue = sorted;
        }
        let queue: Vec<Visit> = queue.into_iter().flatten().collect();
        let owners = first_of_owners(&queue, cut);
        Round { entries: standing.len(), passes, queue, owners }
    }
}

/// First entry of each owner in a queue in the order of subtrees, and the end.
fn first_of_owners(queue: &[Visit], cut: &Cut) -> Vec<u32> {
    let first = |&subtree: &u32| queue.partition_point(|visit| visit.subtree < subtree) as u32;
    cut.first_of_sm().iter().map(first).collect()
}

/// The stay of `ray` that begins at its first step in a subtree from step `from` on; it ends before the first step in
/// a subtree that it is queued for, or with the ray.
fn next_visit(workload: &Workload, cut: &Cut, ray: u32, from: usize, bypass: bool) -> Option<Visit> {
    let steps = workload.trace.of(ray as usize);
    let subtree_of = |step: &u32| match cut.home(*step) {
        Home::Subtree(subtree) => Some(subtree),
        Home::Top(_) => None,
    };
    let begin = from + steps[from..].iter().position(|step| subtree_of(step).is_some())?;
    let subtree = subtree_of(&steps[begin])?;
    let owner = |subtree: u32| cut.subtrees()[subtree as usize].owner;
    let leaves = |step: &u32| {
        subtree_of(step).is_some_and(|next| if bypass { owner(next) != owner(subtree) } else { next != subtree })
    };
    let end = steps[begin..].iter().position(leaves).map_or(steps.len(), |length| begin + length);
    Some(Visit { ray, subtree, steps: (begin as u32, end as u32) })
}

#[cfg(test)]
#[path = "plan_tests.rs"]
mod tests;
