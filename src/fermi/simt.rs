//! A warp's way through a traversal kernel: its basic blocks in order, with the lanes that run each and the
//! cache lines that each of its memory instructions touches.
//!
//! Lanes that part reconverge where the loops end (immediate post-dominators), so the order of blocks and all
//! accesses follow from the step traces alone; time does not enter.

use super::kernel::{Block, Loops};
use super::machine::LINE;
use crate::layout;
use crate::shared::{LEAF_BIT, LEAF_COUNT_MASK, LEAF_COUNT_SHIFT, LEAF_FIRST_MASK, STEP_PUSHED};
use crate::trace::StepTrace;

/// Lanes of a warp.
pub const LANES: usize = 32;

/// Bytes of a node, a triangle, a ray and a hit in memory: those of this project and of the reference kernel.
const NODE: u64 = size_of::<layout::Node>() as u64;
const TRIANGLE: u64 = size_of::<layout::Triangle>() as u64;
const RAY: u64 = size_of::<layout::Ray>() as u64;
const HIT: u64 = size_of::<layout::Hit>() as u64;
/// Bytes of one load instruction of a lane.
const LOAD: u64 = 16;
/// Bytes of a stack entry.
const ENTRY: u64 = 4;

/// What the rays did, and the tree they did it in.
#[derive(Clone, Copy, Debug)]
pub struct Workload<'a> {
    /// Steps of each ray.
    pub trace: &'a StepTrace,
    /// Child links of each node.
    pub children: &'a [[u32; 2]],
    /// Number of triangles.
    pub triangles: usize,
}

/// Where things lie in memory: one allocation after the other, each on a multiple of 256 bytes, as a device
/// allocator makes them.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    nodes: u64,
    triangles: u64,
    rays: u64,
    hits: u64,
    stacks: u64,
    /// Bytes from one stack entry of a thread to its next: entries of all resident threads lie side by side.
    stride: u64,
}

impl Layout {
    /// Lays out `workload` for `threads` resident threads on the whole machine.
    pub fn new(workload: &Workload, threads: u64) -> Layout {
        let mut at = 0x8000_0000;
        let mut place = |bytes: u64| {
            let start = at;
            at += bytes.next_multiple_of(256);
            start
        };
        let rays = workload.trace.rays() as u64;
        Layout {
            nodes: place(workload.children.len() as u64 * NODE),
            triangles: place(workload.triangles as u64 * TRIANGLE),
            rays: place(rays * RAY),
            hits: place(rays * HIT),
            stacks: 0x1000_0000,
            stride: threads * ENTRY,
        }
    }
}

/// Direction and space of a memory instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Load from global memory.
    Load,
    /// Store to global memory.
    Store,
    /// Load from local memory: the stack.
    Pop,
    /// Store to local memory.
    Push,
}

impl Access {
    /// Whether it writes.
    pub fn writes(self) -> bool {
        matches!(self, Access::Store | Access::Push)
    }
}

/// A memory instruction of a segment: lines `lines.0..lines.1` of the batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryOp {
    /// What it does.
    pub access: Access,
    /// Its lines, in the batch.
    pub lines: (u32, u32),
    /// Bytes it wants of a line at most, a multiple of 32.
    pub bytes: u8,
}

/// A basic block run once by some lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// The block.
    pub block: Block,
    /// Lanes that run it.
    pub lanes: u8,
    /// Its memory instructions, in the batch.
    pub memory: (u16, u16),
}

/// Segments that follow each other without a decision in between, and their accesses.
#[derive(Clone, Debug, Default)]
pub struct Batch {
    /// In order.
    pub segments: Vec<Segment>,
    /// Memory instructions of all segments, in order.
    pub memory: Vec<MemoryOp>,
    /// Line numbers (address / 128), in the order in which they are accessed.
    pub lines: Vec<u64>,
}

impl Batch {
    fn clear(&mut self) {
        self.segments.clear();
        self.memory.clear();
        self.lines.clear();
    }
}

#[derive(Clone, Copy, Debug, Default)]
struct Lane<'a> {
    steps: &'a [u32],
    /// Entries on the stack, the end marker not counted.
    depth: u32,
    /// Leaf found and put off, where traversal is speculative.
    postponed: Option<u32>,
}

impl Lane<'_> {
    fn at_node(&self) -> bool {
        self.steps.first().is_some_and(|step| step & LEAF_BIT == 0)
    }

    fn has_leaf(&self) -> bool {
        self.postponed.is_some() || self.at_leaf()
    }

    /// The leaf to be tested next.
    fn leaf(&self) -> u32 {
        self.postponed.or(self.steps.first().copied()).unwrap_or(LEAF_BIT)
    }

    fn at_leaf(&self) -> bool {
        self.steps.first().is_some_and(|step| step & LEAF_BIT != 0)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Entry,
    Outer,
    Nodes,
    Leaves,
    Done,
}

/// The run of one warp.
#[derive(Clone, Debug)]
pub struct Warp<'a> {
    children: &'a [[u32; 2]],
    loops: Loops,
    layout: Layout,
    lanes: [Lane<'a>; LANES],
    first: u64,
    count: usize,
    stack: u64,
    phase: Phase,
    /// Lanes in the loop that is running.
    inside: u32,
}

impl<'a> Warp<'a> {
    /// Warp of the rays from `first` on, fewer than 32 at the end. `thread` is the number of its first thread
    /// among those resident, which places its stack.
    pub fn new(workload: &Workload<'a>, layout: Layout, loops: Loops, first: usize, thread: u64) -> Warp<'a> {
        let count = workload.trace.rays().saturating_sub(first).min(LANES);
        let mut lanes = [Lane::default(); LANES];
        for (i, lane) in lanes[..count].iter_mut().enumerate() {
            lane.steps = workload.trace.of(first + i);
        }
        let stack = layout.stacks + thread * ENTRY;
        let phase = Phase::Entry;
        Warp { children: workload.children, loops, layout, lanes, first: first as u64, count, stack, phase, inside: 0 }
    }

    /// Puts the next segments into `batch`, or none if the warp is done.
    pub fn advance(&mut self, batch: &mut Batch) {
        batch.clear();
        match self.phase {
            Phase::Entry => self.entry(batch),
            Phase::Outer => self.outer(batch),
            Phase::Nodes => self.node(batch),
            Phase::Leaves => self.leaf(batch),
            Phase::Done => {}
        }
    }

    fn entry(&mut self, batch: &mut Batch) {
        self.segment(batch, Block::Entry, self.count);
        if self.count == 0 {
            self.phase = Phase::Done;
            return;
        }
        for part in 0..RAY / LOAD {
            let start = self.layout.rays + self.first * RAY + part * LOAD;
            coalesce(batch, Access::Load, (0..self.count as u64).map(|i| start + i * RAY), LOAD);
        }
        coalesce(batch, Access::Push, (0..self.count as u64).map(|i| self.stack + i * ENTRY), ENTRY);
        self.phase = Phase::Outer;
    }

    fn outer(&mut self, batch: &mut Batch) {
        let active = self.lanes_where(|lane| !lane.steps.is_empty() || lane.postponed.is_some());
        if active == 0 {
            self.segment(batch, Block::Exit, self.count);
            let start = self.layout.hits + self.first * HIT;
            coalesce(batch, Access::Store, (0..self.count as u64).map(|i| start + i * HIT), HIT);
            self.phase = Phase::Done;
            return;
        }
        self.segment(batch, Block::Outer, active.count_ones() as usize);
        self.enter_nodes();
    }

    fn enter_nodes(&mut self) {
        self.inside = self.lanes_where(|lane| lane.at_node());
        self.phase = Phase::Nodes;
        if self.inside == 0 {
            self.enter_leaves();
        }
    }

    fn enter_leaves(&mut self) {
        self.inside = self.lanes_where(|lane| lane.has_leaf());
        self.phase = if self.inside == 0 { Phase::Outer } else { Phase::Leaves };
    }

    /// One turn of the node loop.
    fn node(&mut self, batch: &mut Batch) {
        let inside = self.inside;
        let (mut met, mut pushed) = (0u32, 0u32);
        for lane in bits(inside) {
            let (step, next) = self.step(lane);
            let link = step & !STEP_PUSHED;
            let [a, b] = self.children[link as usize];
            let descends = next.is_some_and(|next| next == a || next == b);
            met |= u32::from(descends) << lane;
            pushed |= u32::from(step & STEP_PUSHED != 0) << lane;
        }
        let popped = inside & !met;

        self.segment(batch, Block::Node, inside.count_ones() as usize);
        let node = |warp: &Self, lane: usize| warp.layout.nodes + u64::from(warp.step(lane).0 & !STEP_PUSHED) * NODE;
        let first = batch.lines.len();
        coalesce(batch, Access::Load, bits(inside).map(|lane| node(self, lane)), LOAD);
        let again = MemoryOp { access: Access::Load, lines: (first as u32, batch.lines.len() as u32), bytes: 32 };
        // A node lies within one line, so its other loads touch the same lines.
        batch.memory.extend([again; 2]);
        batch.segments.last_mut().into_iter().for_each(|segment| segment.memory.1 += 2);

        if met != 0 {
            self.segment(batch, Block::Descend, met.count_ones() as usize);
            coalesce(batch, Access::Load, bits(met).map(|lane| node(self, lane) + NODE - LOAD), LOAD);
        }
        if pushed != 0 {
            for lane in bits(pushed) {
                self.lanes[lane].depth += 1;
            }
            self.segment(batch, Block::Push, pushed.count_ones() as usize);
            coalesce(batch, Access::Push, bits(pushed).map(|lane| self.top(lane)), ENTRY);
        }
        if popped != 0 {
            self.pop(batch, Block::Pop, popped);
        }
        self.segment(batch, Block::NodeEnd, inside.count_ones() as usize);
        for lane in bits(inside) {
            self.lanes[lane].steps = &self.lanes[lane].steps[1..];
        }
        self.inside = inside & self.lanes_where(|lane| lane.at_node());
        if self.loops == Loops::SpeculativeWhileWhile {
            self.speculate(batch, inside);
        }
        if self.inside == 0 {
            self.enter_leaves();
        }
    }

    /// Lanes that have come to their first leaf put it off and take the next node from the stack; the loop ends
    /// when every lane has a leaf (Aila and Laine 2009, section 3.2). The steps are those of a traversal that
    /// tests each leaf at once, so nodes visited in vain because a leaf waits are not among them.
    fn speculate(&mut self, batch: &mut Batch, inside: u32) {
        let found = inside & self.lanes_where(|lane| lane.at_leaf() && lane.postponed.is_none());
        if found != 0 {
            self.pop(batch, Block::Pop, found);
        }
        for lane in bits(found) {
            let lane = &mut self.lanes[lane];
            lane.postponed = lane.steps.first().copied();
            lane.steps = lane.steps.get(1..).unwrap_or_default();
        }
        self.inside |= found & self.lanes_where(|lane| lane.at_node());
        if self.inside & self.lanes_where(|lane| lane.postponed.is_none()) == 0 {
            self.inside = 0;
        }
    }

    /// One turn of the leaf loop.
    fn leaf(&mut self, batch: &mut Batch) {
        let inside = self.inside;
        self.segment(batch, Block::Leaf, inside.count_ones() as usize);
        for turn in 0.. {
            let mut testing = 0u32;
            for lane in bits(inside) {
                testing |= u32::from((self.lanes[lane].leaf() >> LEAF_COUNT_SHIFT) & LEAF_COUNT_MASK > turn) << lane;
            }
            if testing == 0 {
                break;
            }
            self.segment(batch, Block::Triangle, testing.count_ones() as usize);
            for part in 0..TRIANGLE / LOAD {
                let start = |lane: usize| {
                    let triangle = u64::from((self.lanes[lane].leaf() & LEAF_FIRST_MASK) + turn);
                    self.layout.triangles + triangle * TRIANGLE + part * LOAD
                };
                coalesce(batch, Access::Load, bits(testing).map(start), LOAD);
            }
        }
        // A leaf that was put off left the stack when it was.
        let current = inside & self.lanes_where(|lane| lane.postponed.is_none());
        if current != 0 {
            self.pop(batch, Block::LeafPop, current);
        }
        for lane in bits(inside) {
            let lane = &mut self.lanes[lane];
            if lane.postponed.take().is_none() {
                lane.steps = &lane.steps[1..];
            }
        }
        self.inside = inside & self.lanes_where(|lane| lane.has_leaf());
        if self.inside == 0 {
            self.phase = Phase::Outer;
        }
    }

    fn pop(&mut self, batch: &mut Batch, block: Block, lanes: u32) {
        self.segment(batch, block, lanes.count_ones() as usize);
        coalesce(batch, Access::Pop, bits(lanes).map(|lane| self.top(lane)), ENTRY);
        for lane in bits(lanes) {
            self.lanes[lane].depth = self.lanes[lane].depth.saturating_sub(1);
        }
    }

    /// Address of the entry on top of a lane's stack.
    fn top(&self, lane: usize) -> u64 {
        self.stack + u64::from(self.lanes[lane].depth) * self.layout.stride + lane as u64 * ENTRY
    }

    /// A lane's step and the one after it.
    fn step(&self, lane: usize) -> (u32, Option<u32>) {
        let steps = self.lanes[lane].steps;
        let next = steps.get(1).map(|&next| if next & LEAF_BIT == 0 { next & !STEP_PUSHED } else { next });
        (steps.first().copied().unwrap_or(LEAF_BIT), next)
    }

    fn lanes_where(&self, test: impl Fn(&Lane) -> bool) -> u32 {
        self.lanes[..self.count].iter().enumerate().fold(0, |mask, (i, lane)| mask | u32::from(test(lane)) << i)
    }

    fn segment(&self, batch: &mut Batch, block: Block, lanes: usize) {
        let memory = batch.memory.len() as u16;
        batch.segments.push(Segment { block, lanes: lanes as u8, memory: (memory, memory) });
    }
}

/// Indices of the bits set.
fn bits(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = mask.trailing_zeros() as usize;
        mask &= mask.wrapping_sub(1);
        (bit < LANES).then_some(bit)
    })
}

/// Adds a memory instruction to the last segment of `batch`: one access a distinct line, the highest first.
fn coalesce(batch: &mut Batch, access: Access, addresses: impl Iterator<Item = u64>, size: u64) {
    let first = batch.lines.len();
    let (mut low, mut high) = (LINE, 0);
    for address in addresses {
        let line = address / LINE;
        low = low.min(address % LINE);
        high = high.max(address % LINE + size);
        // Lines of one instruction are few and often the same as the last.
        if batch.lines.last().filter(|_| batch.lines.len() > first) != Some(&line)
            && !batch.lines[first..].contains(&line)
        {
            batch.lines.push(line);
        }
    }
    batch.lines[first..].sort_unstable_by(|a, b| b.cmp(a));
    // Half and quarter lines go as such (compute capability 1.3's rule, which the simulator keeps).
    let bytes = match (low / 32, (high - 1) / 32) {
        (a, b) if a == b => 32,
        (a, b) if a / 2 == b / 2 => 64,
        _ => 128,
    };
    let op = MemoryOp { access, lines: (first as u32, batch.lines.len() as u32), bytes };
    batch.memory.push(op);
    if let Some(segment) = batch.segments.last_mut() {
        segment.memory.1 += 1;
    }
}

#[cfg(test)]
#[path = "simt_tests.rs"]
mod tests;
