//! Fidelity `caches`: every access of every warp through L1 and L2, time by formula.
//!
//! Each warp has a clock that advances block by block: by what the block costs a warp alone, by what equation (1)
//! says its slowest load takes, and by the wait for issue. The warp with the earliest clock goes next, so the order
//! of accesses is about that of the machine. What queues add to a miss comes from the contention model, of the
//! traffic that a first pass without queues finds. Multiprocessors meet only in the L2 and in these queues, so one of
//! them can also be replayed by itself ([`one`]), and the L2's hits be found in a short while ([`glimpse`]).

mod replay;
mod second_level;
mod span;

use self::replay::{Queues, Replay, Selection};
use self::second_level::{Found, SecondLevel};
pub use self::span::{Outcome, Span};
use super::cache::Places;
use super::launch::Launch;
use super::machine::Machine;
use super::needs::Demand;
use super::occupancy::launchable;
use super::result::{Counts, CpiStack, Part};
use super::simt::Layout;
use super::times::{Times, line_cycles};
use crate::Result;

/// Replays `launches`, one after the other; the L2 keeps what it has.
///
/// # Errors
/// [`crate::Error::Usage`] if no block fits a multiprocessor.
pub fn replay(machine: &Machine, launches: &[Launch]) -> Result<Vec<Part>> {
    let unloaded = Times::unloaded(machine);
    let mut l2 = SecondLevel::new(machine, None);
    let mut loads = Vec::new();
    for launch in launches {
        let all = Selection::all(machine, launch);
        loads.push(Replay::new(machine, launch, all, Queues::Known(unloaded), (None, &mut l2))?.run().load());
    }
    let mut l2 = SecondLevel::new(machine, None);
    let mut parts = Vec::new();
    for (launch, load) in launches.iter().zip(loads) {
        let times = unloaded.with_queues(machine, &load);
        let all = Selection::all(machine, launch);
        let outcome = Replay::new(machine, launch, all, Queues::Known(times), (None, &mut l2))?.run();
        parts.push(part(machine, launch, times, &outcome)?);
    }
    Ok(parts)
}

/// Caches that hold all that a launch can touch, and so need no replay: see [`super::needs`].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Room {
    /// Places of lines in each first-level cache.
    pub(super) l1: Option<Places>,
    /// Places of lines in the second-level cache.
    pub(super) l2: Option<Places>,
}

/// One pass over `launch` with an L2 that is empty at first and caches that have `room`, loads taking `times`; and what
/// was asked of the L1 of the multiprocessor that asked for the most and of the L2, where they have room.
///
/// # Errors
/// [`crate::Error::Usage`] if no block fits a multiprocessor.
pub(super) fn pass_in(
    machine: &Machine,
    launch: &Launch,
    times: Times,
    room: Room,
) -> Result<(Outcome, [Option<Demand>; 2])> {
    let mut l2 = SecondLevel::new(machine, room.l2);
    let all = Selection::all(machine, launch);
    let mut replay = Replay::new(machine, launch, all, Queues::Known(times), (room.l1, &mut l2))?;
    let outcome = replay.run();
    let l1 = room.l1.and_then(|_| replay.demand());
    Ok((outcome, [l1, room.l2.map(|_| l2.demand(machine))]))
}

/// Multiprocessor `sm` by itself with `blocks` of `launch`, while all others do the like: their traffic is taken to be as
/// its own. It has an even share of the L2, as if no line were of use to two multiprocessors; or, `given` the tree, its
/// lines are all there, as if others had just brought them, and the rest of the L2 is its own.
///
/// # Errors
/// [`crate::Error::Usage`] if no block fits a multiprocessor.
pub(super) fn one(machine: &Machine, launch: &Launch, sm: usize, blocks: &[usize], given: bool) -> Result<Outcome> {
    let l2 = if given { SecondLevel::new(machine, None) } else { SecondLevel::even_share(machine) };
    let mut l2 = l2.with_layout(&Layout::new(&launch.workload, 0), given);
    let selection = Selection { sms: sm..sm + 1, blocks: blocks.to_vec(), run: Vec::new() };
    Ok(Replay::new(machine, launch, selection, Queues::AsFound, (None, &mut l2))?.run())
}

/// Fillings of the L2 before a glimpse counts: what was there before it is gone by then.
const WARM_UP: u64 = 1;

/// Fillings of the L2 that a glimpse counts.
const COUNTED: u64 = 1;

/// Misses of the L2 before the middle of what a glimpse counts.
pub(super) fn misses_before_glimpse(machine: &Machine) -> u64 {
    (2 * WARM_UP + COUNTED) * machine.l2.lines() / 2
}

/// Misses of the L2 in a glimpse.
pub(super) fn misses_of_glimpse(machine: &Machine) -> u64 {
    (WARM_UP + COUNTED) * machine.l2.lines()
}

/// Accesses of the L2 for lines of the tree and of stacks during a short while in the middle of `launch`: from when
/// the first of `blocks` have run for so many cycles as `run` has, taken alone, until the L2 has been filled a few times.
/// All that follow if they end before.
///
/// # Errors
/// [`crate::Error::Usage`] if no block fits a multiprocessor.
pub(super) fn glimpse(
    machine: &Machine,
    launch: &Launch,
    (blocks, run): (Vec<usize>, Vec<f64>),
    times: Times,
) -> Result<Counts> {
    let mut l2 = SecondLevel::new(machine, None).with_layout(&Layout::new(&launch.workload, 0), false);
    let (warm, end) = (WARM_UP * machine.l2.lines(), misses_of_glimpse(machine));
    let selection = Selection { sms: 0..machine.sms as usize, blocks, run };
    let mut replay = Replay::new(machine, launch, selection, Queues::Known(times), (None, &mut l2))?;
    replay.start();
    while replay.found().all.misses < warm && replay.step() {}
    let before = replay.found();
    while replay.found().all.misses < end && replay.step() {}
    let after = replay.found();
    // A launch that fills the L2 but once or less never leaves the start behind.
    let before = if after.all.misses <= warm { Found::default() } else { before };
    Ok(after.reused.since(before.reused))
}

/// The result of a launch.
pub(super) fn part(machine: &Machine, launch: &Launch, times: Times, outcome: &Outcome) -> Result<Part> {
    let total = &outcome.total;
    let sms = f64::from(machine.sms);
    // The throughput law: no faster than issue and the channels allow.
    let issue = total.instructions.warp as f64 / sms / f64::from(machine.sm.schedulers.min(machine.sm.fetch));
    let memory = total.l2.misses as f64 * line_cycles(machine) / f64::from(machine.dram.channels);
    let cycles = outcome.cycles.max(issue).max(memory).ceil();
    let efficiency = total.instructions.efficiency();
    let stalled = (outcome.busy_cycles - issue).max(0.0);
    let share = total.memory / (total.memory + total.compute).max(1.0);
    Ok(Part {
        stage: launch.stage,
        cycles,
        instructions: total.instructions,
        visits: total.visits,
        l1: total.l1,
        l2: total.l2,
        latency: times.latency(total.l1, total.l2),
        occupancy: launchable(machine, launch)?,
        cpi: CpiStack {
            base: issue * efficiency,
            divergence: issue * (1.0 - efficiency),
            compute_data: stalled * (1.0 - share),
            memory_data: stalled * share,
            idle: cycles - issue - stalled,
            ..CpiStack::default()
        },
    })
}
