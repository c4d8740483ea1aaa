//! The loops of a traversal: nodes, then leaves, until all lanes are done.

use super::LANES;
use super::batch::{Access, Batch, bits};
use super::layout::{LOAD, WORD, bytes};
use super::warp::{Phase, Warp};
use crate::fermi::kernel::{Block, Loops};
use crate::layout::{Node, Triangle};
use crate::shared::{LEAF_BIT, LEAF_COUNT_MASK, LEAF_COUNT_SHIFT, LEAF_FIRST_MASK, STEP_PUSHED};

impl Warp<'_> {
    pub(super) fn outer(&mut self, batch: &mut Batch) {
        let entered = if self.looping == 0 { self.all() } else { self.looping };
        let active = self.lanes_where(entered, |lane| !lane.steps.is_empty() || lane.postponed.is_some());
        if self.looping != 0 {
            batch.segment(Block::OuterEnd, self.looping);
        }
        self.looping = active;
        if active == 0 {
            self.traversed();
            return;
        }
        batch.segment(Block::Outer, active);
        self.enter_nodes();
    }

    fn enter_nodes(&mut self) {
        self.inside = self.lanes_where(self.looping, |lane| lane.at_node());
        self.phase = Phase::Nodes;
        if self.inside == 0 {
            self.enter_leaves();
        }
    }

    fn enter_leaves(&mut self) {
        self.inside = self.lanes_where(self.looping, |lane| lane.has_leaf());
        self.phase = if self.inside == 0 { Phase::Outer } else { Phase::Leaves };
    }

    /// One turn of the node loop.
    pub(super) fn node(&mut self, batch: &mut Batch) {
        let inside = self.inside;
        let (mut met, mut pushed, mut stay) = (0u32, 0u32, 0u32);
        let mut nodes = [0u32; LANES];
        for lane in bits(inside) {
            let steps = &mut self.lanes[lane].steps;
            let Some((&step, rest)) = steps.split_first() else { continue };
            *steps = rest;
            nodes[lane] = step & !STEP_PUSHED;
            let pushes = step & STEP_PUSHED != 0;
            let next = rest.first().map(|&next| if next & LEAF_BIT == 0 { next & !STEP_PUSHED } else { next });
            // Whoever puts one child off goes on to the other.
            let child = |next: u32| self.launch.workload.children[step as usize].contains(&next);
            met |= u32::from(pushes || next.is_some_and(child)) << lane;
            pushed |= u32::from(pushes) << lane;
            stay |= u32::from(next.is_some_and(|next| next & LEAF_BIT == 0)) << lane;
        }
        let popped = inside & !met;

        batch.segment(Block::Node, inside);
        let layout = self.layout;
        let node = |lane: usize| layout.node(nodes[lane]);
        batch.access(Access::Load, bits(inside).map(node), LOAD);
        // A node lies within one line, so its other loads touch the same lines.
        batch.again(2);

        if met != 0 {
            batch.segment(Block::Descend, met);
            batch.access(Access::Load, bits(met).map(|lane| node(lane) + bytes::<Node>() - LOAD), LOAD);
        }
        if pushed != 0 {
            for lane in bits(pushed) {
                self.lanes[lane].depth += 1;
            }
            batch.segment(Block::Push, pushed);
            batch.access(Access::Push, bits(pushed).map(|lane| self.top(lane)), WORD);
        }
        if popped != 0 {
            self.pop(batch, Block::Pop, popped);
        }
        batch.segment(Block::NodeEnd, inside);
        self.inside = stay;
        if self.launch.kernel.loops == Loops::SpeculativeWhileWhile {
            self.speculate(batch, inside);
        }
        if self.inside == 0 {
            self.enter_leaves();
        }
    }

    /// Lanes that have come to their first leaf put it off and take the next node from the stack; the loop ends
    /// when every lane has a leaf (Aila and Laine 2009, section 3.2). Steps as of
    /// [`crate::trace::speculative`] have the nodes that are visited in vain because a leaf waits; those of a traversal
    /// that tests each leaf at once have not.
    fn speculate(&mut self, batch: &mut Batch, inside: u32) {
        let found = self.lanes_where(inside, |lane| lane.at_leaf() && lane.postponed.is_none());
        if found != 0 {
            self.pop(batch, Block::Pop, found);
        }
        for lane in bits(found) {
            let lane = &mut self.lanes[lane];
            lane.postponed = lane.steps.first().copied();
            lane.steps = lane.steps.get(1..).unwrap_or_default();
        }
        self.inside |= self.lanes_where(found, |lane| lane.at_node());
        if self.lanes_where(self.inside, |lane| lane.postponed.is_none()) == 0 {
            self.inside = 0;
        }
    }

    /// One turn of the leaf loop.
    pub(super) fn leaf(&mut self, batch: &mut Batch) {
        let inside = self.inside;
        batch.segment(Block::Leaf, inside);
        let marked = self.launch.kernel.loops == Loops::SpeculativeWhileWhile;
        let load = if self.launch.kernel.textured() { Access::Texture } else { Access::Load };
        let mut leaves = [0u32; LANES];
        bits(inside).for_each(|lane| leaves[lane] = self.lanes[lane].leaf());
        let mut reading = inside;
        for turn in 0.. {
            let count = |lane: usize| leaves[lane] >> LEAF_COUNT_SHIFT & LEAF_COUNT_MASK;
            let testing = bits(reading).fold(0u32, |mask, lane| mask | u32::from(count(lane) > turn) << lane);
            let part =
                |lane: usize, part: u64| self.layout.triangle((leaves[lane] & LEAF_FIRST_MASK) + turn) + part * LOAD;
            // The mark is taken to lie where the next leaf's first triangle does.
            if marked && reading != 0 {
                batch.segment(Block::Mark, reading);
                batch.access(load, bits(reading).map(|lane| part(lane, 0)), LOAD);
            }
            if testing == 0 {
                break;
            }
            batch.segment(Block::Triangle, testing);
            for k in u64::from(marked)..bytes::<Triangle>() / LOAD {
                batch.access(load, bits(testing).map(|lane| part(lane, k)), LOAD);
            }
            reading = testing;
        }
        // A leaf that was put off left the stack when it was.
        let (mut current, mut stay) = (0u32, 0u32);
        for number in bits(inside) {
            let lane = &mut self.lanes[number];
            if lane.postponed.take().is_none() {
                lane.steps = &lane.steps[1..];
                current |= 1 << number;
            }
            stay |= u32::from(lane.at_leaf()) << number;
        }
        if current != 0 {
            self.pop(batch, Block::LeafPop, current);
        }
        self.inside = stay;
        if self.inside == 0 {
            self.phase = Phase::Outer;
        }
    }

    fn pop(&mut self, batch: &mut Batch, block: Block, lanes: u32) {
        batch.segment(block, lanes);
        batch.access(Access::Pop, bits(lanes).map(|lane| self.top(lane)), WORD);
        for lane in bits(lanes) {
            self.lanes[lane].depth = self.lanes[lane].depth.saturating_sub(1);
        }
    }

    /// Address of the entry on top of a lane's stack.
    fn top(&self, lane: usize) -> u64 {
        self.layout.stack(self.thread + lane as u64, self.lanes[lane].depth)
    }
}
