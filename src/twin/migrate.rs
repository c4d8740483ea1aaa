//! Twin of `schedule.comp`, `migrate.comp` and the queue kernels: strategy `migrate`, round by round.

use rayon::prelude::*;

use super::top_tree::{Stand, next_subtree};
use super::trace::{finished, missed, prepare};
use super::trail::{Trail, cursor_of_trail, trail_of_stack};
use super::traverse::{StepSink, traverse};
use crate::bvh::{Bvh, Partition};
use crate::layout::{Hit, QueueEntry, Ray, RayCounters, Travel, Visit};
use crate::shared::{LINK_DONE, NO_HIT, SUBTREE_LINK, WARP};

/// A tree, its partition, and how many invocations an SM has.
#[derive(Clone, Copy)]
pub struct Machine<'a> {
    /// The tree.
    pub bvh: &'a Bvh,
    /// Its subtrees and their owners.
    pub partition: &'a Partition,
    /// Warps of [`WARP`] invocations.
    pub warps_per_sm: u32,
    /// Steps of an invocation in a round.
    pub quota: u32,
}

/// Rays on their way.
pub struct Migration<'a, S> {
    machine: Machine<'a>,
    rays: &'a [Ray],
    /// Best hit of each ray so far.
    pub hits: Vec<Hit>,
    /// What each ray did so far.
    pub counters: Vec<RayCounters>,
    /// Steps of each ray.
    pub sinks: Vec<S>,
    travels: Vec<Travel>,
    queue: Vec<QueueEntry>,
}

/// A ray's record while an invocation holds it.
struct Held<S> {
    hit: Hit,
    travel: Travel,
    sink: S,
    visit: Visit,
}

impl<'a, S: StepSink> Migration<'a, S> {
    /// Every ray's first walk of the top tree.
    pub fn schedule(machine: Machine<'a>, rays: &'a [Ray]) -> Migration<'a, S> {
        let scheduled: Vec<(Hit, RayCounters, S, Travel)> = rays
            .par_iter()
            .map(|ray| {
                let (mut counted, mut sink, mut trail) = (RayCounters::default(), S::default(), Trail::default());
                let mut next = LINK_DONE;
                if ray.is_live() {
                    let stand = Stand { link: machine.partition.root, above: 0, came_from: 0 };
                    let prepared = prepare(machine.bvh, ray);
                    let place = (&mut trail, &mut counted, &mut sink, &mut 0);
                    next = next_subtree(machine.partition, &prepared, ray.t_max, stand, place);
                }
                (missed(ray), counted, sink, travel_to(machine.partition, next, trail))
            })
            .collect();
        let mut migration = Migration {
            machine,
            rays,
            hits: Vec::new(),
            counters: Vec::new(),
            sinks: Vec::new(),
            travels: Vec::new(),
            queue: Vec::new(),
        };
        for (hit, counted, sink, travel) in scheduled {
            migration.queue.push(QueueEntry { ray: migration.queue.len() as u32, subtree: travel.subtree });
            migration.hits.push(hit);
            migration.counters.push(counted);
            migration.sinks.push(sink);
            migration.travels.push(travel);
        }
        migration
    }

    /// Entries of rays that have not ended.
    pub fn queued(&self) -> usize {
        self.queue.iter().filter(|entry| entry.subtree != LINK_DONE).count()
    }

    /// Sorts the queue and goes through it once. Returns what became of each entry; nothing when no ray is
    /// active.
    pub fn round<const ANY_HIT: bool>(&mut self) -> Vec<Visit> {
        self.queue.retain(|entry| entry.subtree != LINK_DONE);
        self.queue.sort_by_key(|entry| entry.subtree);
        let invocations = self.machine.partition.sms() * self.machine.warps_per_sm * WARP;
        let this = &*self;
        let stored: Vec<(usize, Held<S>)> = (0..invocations)
            .into_par_iter()
            .flat_map_iter(|invocation| this.invocation::<ANY_HIT>(invocation))
            .collect();
        let mut visits: Vec<Visit> = self.queue.iter().copied().map(Visit::waiting).collect();
        for (at, held) in stored {
            let ray = held.visit.ray as usize;
            self.hits[ray] = held.hit;
            self.travels[ray] = held.travel;
            self.sinks[ray].append(held.sink);
            self.counters[ray] += held.visit.counted;
            self.queue[at].subtree = held.travel.subtree;
            visits[at] = held.visit;
        }
        visits
    }

    /// The entries that an invocation takes from its SM's queues, in order, and what it does with them.
    fn invocation<const ANY_HIT: bool>(&self, invocation: u32) -> Vec<(usize, Held<S>)> {
        let lanes = self.machine.warps_per_sm * WARP;
        let sm = invocation / lanes;
        let first = &self.machine.partition.first_of_sm[sm as usize..];
        let entry_of = |subtree| self.queue.partition_point(|entry| entry.subtree < subtree);
        let mut steps = 0;
        let mut stored = Vec::new();
        for at in (entry_of(first[0]) + (invocation % lanes) as usize..entry_of(first[1])).step_by(lanes as usize) {
            if steps >= self.machine.quota {
                break;
            }
            stored.push((at, self.visit::<ANY_HIT>(sm, self.queue[at], &mut steps)));
        }
        stored
    }

    /// Takes a ray through its subtree, and on through others as long as they are the same SM's.
    fn visit<const ANY_HIT: bool>(&self, sm: u32, entry: QueueEntry, steps: &mut u32) -> Held<S> {
        let Machine { bvh, partition, quota, .. } = self.machine;
        let ray = prepare(bvh, &self.rays[entry.ray as usize]);
        let mut travel = self.travels[entry.ray as usize];
        let mut hit = self.hits[entry.ray as usize];
        let (mut counted, mut sink) = (RayCounters::default(), S::default());
        loop {
            let subtree = &partition.subtrees[travel.subtree as usize];
            counted.subtrees += u32::from(travel.link == subtree.root);
            let mut trail = Trail::from_words(travel.trail);
            let mut cursor = cursor_of_trail(&bvh.nodes, (subtree.root, subtree.level), travel.link, trail);
            trail = trail.above(subtree.level);
            traverse::<ANY_HIT, S>(bvh, &ray, &mut cursor, &mut hit, &mut counted, &mut sink, (steps, quota));
            if cursor.link != LINK_DONE {
                travel.trail = trail_of_stack(&bvh.nodes, (subtree.root, subtree.level), &cursor, trail).words();
                travel.link = cursor.link;
                counted.suspensions += 1;
                break;
            }
            let mut next = LINK_DONE;
            if !ANY_HIT || hit.prim == NO_HIT {
                let stand = Stand { link: LINK_DONE, above: subtree.parent, came_from: SUBTREE_LINK | travel.subtree };
                next = next_subtree(partition, &ray, hit.t, stand, (&mut trail, &mut counted, &mut sink, steps));
            }
            travel = travel_to(partition, next, trail);
            let stays = next != LINK_DONE && partition.subtrees[travel.subtree as usize].owner == sm;
            counted.bypasses += u32::from(stays);
            counted.migrations += u32::from(!stays && next != LINK_DONE);
            if !stays || *steps >= quota {
                break;
            }
        }
        if travel.subtree == LINK_DONE {
            hit = finished::<ANY_HIT>(hit);
        }
        let visit = Visit { ray: entry.ray, subtree: entry.subtree, next: travel.subtree, taken: 1, counted };
        Held { hit, travel, sink, visit }
    }
}

/// Where a ray stands that is to enter the subtree of a top-tree link, or has ended with [`LINK_DONE`].
fn travel_to(partition: &Partition, link: u32, trail: Trail) -> Travel {
    if link == LINK_DONE {
        return Travel { trail: [0; 2], link: LINK_DONE, subtree: LINK_DONE };
    }
    let subtree = link & !SUBTREE_LINK;
    Travel { trail: trail.words(), link: partition.subtrees[subtree as usize].root, subtree }
}
