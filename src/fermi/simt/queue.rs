//! The kernels that make queues, as warps run them.

use super::batch::{Access, Batch, bits};
use super::layout::{WORD, bytes};
use super::warp::{Phase, Warp};
use crate::fermi::kernel::Block;
use crate::fermi::launch::Work;
use crate::fermi::plan::LEFT_OUT;
use crate::fermi::sort::{Kind, Pass};
use crate::layout::QueueEntry;
use crate::shared::{PREFIX_LANES, WARP};

/// How far a warp of the counting sort has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Progress {
    loops: [Loop; 4],
    /// Loop that runs, and its next turn.
    at: (usize, usize),
}

/// A loop of a queue kernel and its number of turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Loop(Block, usize);

impl Progress {
    pub(super) fn new(pass: Pass) -> Progress {
        let none = Loop(Block::Exit, 0);
        // Turns in which 32 lanes go through all digits.
        let rows = pass.digits / WARP as usize;
        let (clear, tally) = (Loop(Block::Clear, pass.digits), Loop(Block::Tally, pass.strip()));
        let loops = match pass.kind {
            Kind::Count => [clear, tally, Loop(Block::Total, rows), none],
            Kind::Scatter => [clear, tally, Loop(Block::Place, rows), Loop(Block::Move, pass.strip())],
            Kind::Prefix => {
                let scan = Loop(Block::Scan, PREFIX_LANES.ilog2() as usize);
                [Loop(Block::Sum, pass.part()), scan, Loop(Block::Spread, pass.part()), none]
            }
            Kind::Shares => {
                let steps = pass.entries.next_power_of_two().ilog2() as usize;
                [Loop(Block::Search, steps), Loop(Block::Share, 1), none, none]
            }
        };
        Progress { loops, at: (0, 0) }
    }
}

impl Warp<'_> {
    /// The next turn of the sort's loops.
    pub(super) fn sort(&mut self, batch: &mut Batch, mut progress: Progress) {
        let Work::Sort(pass) = self.launch.work else { return };
        while progress.at.0 < progress.loops.len() && progress.at.1 == progress.loops[progress.at.0].1 {
            progress.at = (progress.at.0 + 1, 0);
        }
        let Some(&Loop(block, _)) = progress.loops.get(progress.at.0) else {
            self.phase = Phase::Exit;
            return;
        };
        self.turn_of(batch, &pass, block, progress.at.1);
        progress.at.1 += 1;
        self.phase = Phase::Sort(progress);
    }

    fn turn_of(&self, batch: &mut Batch, pass: &Pass, block: Block, turn: usize) {
        let entry = |lane: usize| (self.first + lane) * pass.strip() + turn;
        let counts = pass.digits * pass.tiles();
        let count = |lane: usize| (self.first + lane) * pass.part() + turn;
        let within = |of: &dyn Fn(usize) -> usize, end: usize| {
            bits(self.all()).filter(|&lane| of(lane) < end).fold(0u32, |mask, lane| mask | 1 << lane)
        };
        let at = |of: &dyn Fn(usize) -> usize, lanes: u32| bits(lanes).map(of).collect::<Vec<usize>>().into_iter();
        let lanes = match block {
            Block::Tally => within(&entry, pass.entries),
            Block::Move => bits(within(&entry, pass.entries))
                .filter(|&lane| pass.places[entry(lane)] != LEFT_OUT)
                .fold(0, |mask, lane| mask | 1 << lane),
            Block::Sum | Block::Spread => within(&count, counts),
            _ => self.all(),
        };
        if lanes == 0 {
            return;
        }
        batch.segment(block, lanes);
        // The digit that a lane counts, in the table of digits and tiles.
        let total = |lane: usize| (turn * WARP as usize + lane) * pass.tiles() + self.first / WARP as usize;
        let (layout, counts) = (self.layout, at(&count, lanes));
        match block {
            Block::Tally => batch.access(Access::Load, at(&entry, lanes).map(|i| layout.queue(0, i) + WORD), WORD),
            Block::Total => batch.access(Access::Store, at(&total, lanes).map(|i| layout.count(i)), WORD),
            Block::Place => batch.access(Access::Load, at(&total, lanes).map(|i| layout.count(i)), WORD),
            Block::Sum => batch.access(Access::Load, counts.map(|i| layout.count(i)), WORD),
            Block::Spread => {
                batch.access(Access::Load, counts.clone().map(|i| layout.count(i)), WORD);
                batch.access(Access::Store, counts.map(|i| layout.count(i)), WORD);
            }
            Block::Move => {
                let size = bytes::<QueueEntry>();
                batch.access(Access::Load, at(&entry, lanes).map(|i| layout.queue(0, i)), size);
                let places = at(&entry, lanes).map(|i| layout.queue(1, pass.places[i] as usize));
                batch.access(Access::Store, places, size);
            }
            Block::Search => {
                // Lanes look for different multiprocessors, so they part at the first step.
                let share = pass.entries >> (turn + 1);
                let probes = bits(lanes)
                    .map(|lane| (pass.entries * (self.first + lane) / pass.threads() + share).min(pass.entries - 1));
                batch.access(Access::Load, probes.map(|i| layout.queue(0, i) + WORD), WORD);
            }
            Block::Share => {
                batch.access(Access::Store, bits(lanes).map(|lane| layout.count(self.first + lane)), WORD);
            }
            _ => {}
        }
    }
}
