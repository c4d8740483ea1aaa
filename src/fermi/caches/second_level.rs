//! The L2 of a replay.

use std::ops::Range;

use super::span::Span;
use crate::fermi::addresses::Addresses;
use crate::fermi::cache::{Cache, Lookup, Places};
use crate::fermi::machine::{Machine, Mapping};
use crate::fermi::needs::Demand;
use crate::fermi::result::Counts;

/// Accesses of an L2.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Found {
    /// Of any line.
    pub(super) all: Counts,
    /// Of a line of the tree, where that is known.
    pub(super) tree: Counts,
}

/// The L2, which outlives a launch.
pub(super) struct SecondLevel {
    /// How lines are spread over slices; none where one cache stands for all of them.
    addresses: Option<Addresses>,
    slices: Vec<Cache>,
    /// Lines of the tree, which are of use to all multiprocessors, and whether they are always there.
    tree: Range<u64>,
    given: bool,
    /// Accesses of all caches so far: the clock of their replacement.
    pub(super) ticks: u64,
    /// What it did so far.
    pub(super) found: Found,
}

impl SecondLevel {
    /// Empty; with a place for each line if there is `room`.
    pub(super) fn new(machine: &Machine, room: Option<Places>) -> SecondLevel {
        match room {
            Some(places) => SecondLevel::of(None, vec![Cache::roomy(places)]),
            None => SecondLevel::of_sets(machine, machine.l2.sets()),
        }
    }

    /// What each multiprocessor has if they divide it: sets are a power of two, so the next smaller.
    pub(super) fn even_share(machine: &Machine) -> SecondLevel {
        let sets = (machine.l2.sets() / u64::from(machine.sms)).max(1);
        SecondLevel::of_sets(machine, 1 << sets.ilog2())
    }

    /// With the lines of `tree` known as such; with all of them there before they are asked for if it is `given`.
    pub(super) fn with_tree(self, tree: Range<u64>, given: bool) -> SecondLevel {
        SecondLevel { tree, given, ..self }
    }

    /// Empty, with so many sets a slice.
    fn of_sets(machine: &Machine, sets: u64) -> SecondLevel {
        let slice = Cache::new(sets, machine.l2.ways, Mapping::Linear);
        SecondLevel::of(Some(Addresses::new(machine)), vec![slice; machine.l2.slices as usize])
    }

    fn of(addresses: Option<Addresses>, slices: Vec<Cache>) -> SecondLevel {
        SecondLevel { addresses, slices, tree: 0..0, given: false, ticks: 0, found: Found::default() }
    }

    /// What was asked of one with room for all lines.
    pub(super) fn demand(&self, machine: &Machine) -> Demand {
        let (addresses, sets) = (Addresses::new(machine), machine.l2.sets() as usize);
        let set = |line: u64| {
            let home = addresses.home(line);
            home.slice * sets + home.local as usize % sets
        };
        Demand::new(self.slices[0].held().map(set), sets * machine.l2.slices as usize, machine.l2.ways)
    }

    /// One line, for a block that did `span`. Returns whether it was there.
    pub(super) fn access(&mut self, line: u64, span: &mut Span) -> bool {
        let of_tree = self.tree.contains(&line);
        let there = (of_tree && self.given) || self.look(line);
        let count = |counts: &mut Counts| {
            counts.accesses += 1;
            counts.misses += u64::from(!there);
        };
        count(&mut span.l2);
        count(&mut self.found.all);
        if of_tree {
            count(&mut span.tree);
            count(&mut self.found.tree);
        }
        there
    }

    fn look(&mut self, line: u64) -> bool {
        let home = self.addresses.map(|addresses| addresses.home(line));
        let (slice, local) = home.map_or((0, line), |home| (home.slice, home.local));
        let slice = &mut self.slices[slice];
        match slice.look(local) {
            Lookup::Hit(way) | Lookup::Pending(way) => {
                slice.touch(way, self.ticks);
                true
            }
            Lookup::Miss(way) => {
                slice.reserve(way, local, self.ticks);
                slice.fill(way);
                false
            }
            Lookup::Full => false,
        }
    }
}
