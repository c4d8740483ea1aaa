//! A warp's way through its kernel, phase by phase.

use super::batch::{Access, Batch, bits};
use super::layout::{LOAD, Layout, WORD, bytes};
use super::visits::Stay;
use super::{LANES, queue};
use crate::fermi::kernel::Block;
use crate::fermi::launch::{Launch, Work};
use crate::layout::{Hit, Ray};
use crate::shared::LEAF_BIT;

/// A lane in a tree.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lane<'a> {
    /// Steps in the whole tree or in the subtree that are still to be taken.
    pub(super) steps: &'a [u32],
    /// Entries on the stack, the end marker not counted.
    pub(super) depth: u32,
    /// Leaf found and put off, where traversal is speculative.
    pub(super) postponed: Option<u32>,
}

impl Lane<'_> {
    pub(super) fn at_node(&self) -> bool {
        self.steps.first().is_some_and(|step| step & LEAF_BIT == 0)
    }

    pub(super) fn at_leaf(&self) -> bool {
        self.steps.first().is_some_and(|step| step & LEAF_BIT != 0)
    }

    pub(super) fn has_leaf(&self) -> bool {
        self.postponed.is_some() || self.at_leaf()
    }

    /// The leaf to be tested next.
    pub(super) fn leaf(&self) -> u32 {
        self.postponed.or(self.steps.first().copied()).unwrap_or(LEAF_BIT)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Phase {
    Entry,
    /// Head of the outer loop of a traversal.
    Outer,
    Nodes,
    Leaves,
    /// Rays are taken from a queue.
    Take,
    /// Subtrees are done: to the next.
    Walk,
    /// The counting sort of queues.
    Sort(queue::Progress),
    Exit,
    Done,
}

/// The run of one warp.
#[derive(Clone, Debug)]
pub struct Warp<'a> {
    pub(super) launch: &'a Launch<'a>,
    pub(super) layout: Layout,
    pub(super) lanes: [Lane<'a>; LANES],
    /// Number of its first thread in the launch.
    pub(super) first: usize,
    /// Number of its first thread among those resident, which places its stack.
    pub(super) thread: u64,
    pub(super) count: usize,
    pub(super) phase: Phase,
    /// Lanes in the outer loop of a traversal, and in the loop inside it that is running.
    pub(super) looping: u32,
    pub(super) inside: u32,
    /// Of rays that go from queue to queue.
    pub(super) stay: Option<Box<Stay<'a>>>,
}

impl<'a> Warp<'a> {
    /// Warp `warp` of block `block`. `thread` is the number of its first thread among those resident.
    pub fn new(launch: &'a Launch<'a>, layout: Layout, block: usize, warp: usize, thread: u64) -> Warp<'a> {
        let first = block * launch.block_threads() + warp * LANES;
        let in_block = launch.block_threads().saturating_sub(warp * LANES).min(LANES);
        let mut lanes = [Lane::default(); LANES];
        let mut stay = None;
        let count = match launch.work {
            Work::Rays | Work::Persistent => {
                let trace = launch.workload.trace;
                let count = trace.rays().saturating_sub(first).min(in_block);
                lanes.iter_mut().zip(first..first + count).for_each(|(lane, ray)| lane.steps = trace.of(ray));
                count
            }
            Work::Schedule => {
                let count = launch.workload.trace.rays().saturating_sub(first).min(in_block);
                stay = Some(Box::new(Stay::scheduled(launch, first, count)));
                count
            }
            Work::Visits { queue, blocks, .. } => {
                let range = blocks[block] as usize..blocks[block + 1] as usize;
                stay = Some(Box::new(Stay::queued(queue, range, warp * LANES, launch.block_threads())));
                in_block
            }
            Work::Sort(_) => in_block,
        };
        let phase = Phase::Entry;
        Warp { launch, layout, lanes, first, thread, count, phase, looping: 0, inside: 0, stay }
    }

    /// Puts the next segments into `batch`, or none if the warp is done.
    pub fn advance(&mut self, batch: &mut Batch) {
        batch.clear(self.layout.request);
        while batch.segments.is_empty() && self.phase != Phase::Done {
            match self.phase {
                Phase::Entry => self.entry(batch),
                Phase::Outer => self.outer(batch),
                Phase::Nodes => self.node(batch),
                Phase::Leaves => self.leaf(batch),
                Phase::Take => self.take(batch),
                Phase::Walk => self.walk(batch),
                Phase::Sort(progress) => self.sort(batch, progress),
                Phase::Exit => self.exit(batch),
                Phase::Done => {}
            }
        }
    }

    fn entry(&mut self, batch: &mut Batch) {
        let all = self.all();
        if let Work::Visits { charged: false, .. } = self.launch.work {
            self.phase = Phase::Take;
            return;
        }
        batch.segment(Block::Entry, all);
        match self.launch.work {
            Work::Rays | Work::Persistent => {
                self.load_rays(batch, self.first..self.first + self.count);
                let stack = self.layout.stack(self.thread, 0);
                batch.access(Access::Push, (0..self.count as u64).map(|lane| stack + lane * WORD), WORD);
                self.phase = Phase::Outer;
            }
            Work::Schedule => {
                self.load_rays(batch, self.first..self.first + self.count);
                self.phase = Phase::Walk;
            }
            Work::Visits { .. } => {
                // Where the entries of this multiprocessor begin and end.
                for bound in 0..2 {
                    batch.access(Access::Load, std::iter::once(self.layout.count(bound)), WORD);
                }
                self.phase = Phase::Take;
            }
            Work::Sort(pass) => {
                batch.access(Access::Load, std::iter::once(self.layout.count(0)), LOAD);
                self.phase = Phase::Sort(queue::Progress::new(pass));
            }
        }
        if self.count == 0 {
            self.phase = Phase::Done;
        }
    }

    /// A ray is two loads a lane.
    pub(super) fn load_rays(&self, batch: &mut Batch, rays: impl Iterator<Item = usize> + Clone) {
        for part in 0..bytes::<Ray>() / LOAD {
            batch.access(Access::Load, rays.clone().map(|ray| self.layout.ray(ray) + part * LOAD), LOAD);
        }
    }

    fn exit(&mut self, batch: &mut Batch) {
        batch.segment(Block::Exit, self.all());
        if let Work::Rays | Work::Persistent = self.launch.work {
            let rays = self.first..self.first + self.count;
            batch.access(Access::Store, rays.map(|ray| self.layout.hit(ray)), bytes::<Hit>());
        }
        self.phase = Phase::Done;
    }

    /// Traversal has ended for all lanes.
    pub(super) fn traversed(&mut self) {
        self.phase = match self.launch.work {
            Work::Visits { charged: true, .. } => Phase::Walk,
            Work::Visits { charged: false, .. } => Phase::Take,
            _ => Phase::Exit,
        };
    }

    pub(super) fn all(&self) -> u32 {
        (1u64 << self.count).wrapping_sub(1) as u32
    }

    /// Of `lanes`, those as asked.
    pub(super) fn lanes_where(&self, lanes: u32, test: impl Fn(&Lane) -> bool) -> u32 {
        bits(lanes).fold(0, |mask, lane| mask | u32::from(test(&self.lanes[lane])) << lane)
    }
}
