//! The L2 of a replay.

use std::ops::Range;

use super::span::Span;
use crate::fermi::addresses::Addresses;
use crate::fermi::cache::{Cache, Lookup, Places};
use crate::fermi::machine::{Machine, Mapping};
use crate::fermi::needs::Demand;
use crate::fermi::result::Counts;
use crate::fermi::simt::Layout;

/// Accesses of an L2.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Found {
    /// Of any line.
    pub(super) all: Counts,
    /// Of a line that is asked for again and again, of the tree or of a stack, where that is known.
    pub(super) reused: Counts,
}

/// The L2, which outlives a launch.
pub(super) struct SecondLevel {
    /// How lines are spread over slices; none where one cache stands for all of them.
    addresses: Option<Addresses>,
    slices: Vec<Cache>,
    /// Lines that are always there: of the tree, if it is given.
    given: Range<u64>,
    /// Lines that are asked for once, where they are told apart.
    streamed: Option<Range<u64>>,
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

    /// With the lines that `layout` streams told apart; and with those of the tree there before they are asked for, if it
    /// is `given`.
    pub(super) fn with_layout(self, layout: &Layout, given: bool) -> SecondLevel {
        let given = if given { layout.tree_lines() } else { 0..0 };
        SecondLevel { given, streamed: Some(layout.streamed_lines()), ..self }
    }

    /// Empty, with so many sets a slice.
    fn of_sets(machine: &Machine, sets: u64) -> SecondLevel {
        let slice = Cache::new(sets, machine.l2.ways, Mapping::Linear);
        SecondLevel::of(Some(Addresses::new(machine)), vec![slice; machine.l2.slices as usize])
    }

    fn of(addresses: Option<Addresses>, slices: Vec<Cache>) -> SecondLevel {
        SecondLevel { addresses, slices, given: 0..0, streamed: None, ticks: 0, found: Found::default() }
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
        let reused = self.streamed.as_ref().is_some_and(|streamed| !streamed.contains(&line));
        let there = self.given.contains(&line) || self.look(line);
        let count = |counts: &mut Counts| {
            counts.accesses += 1;
            counts.misses += u64::from(!there);
        };
        count(&mut span.l2);
        count(&mut self.found.all);
        if reused {
            count(&mut span.reused);
            count(&mut self.found.reused);
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
