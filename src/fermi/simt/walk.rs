//! The walk of the top tree from one subtree to the next, by its trail (`glsl/include/top_tree.glsl`).

use super::LANES;
use super::batch::{Access, Batch, bits};
use super::layout::{LOAD, bytes};
use super::visits::{Held, Stay, holding};
use super::warp::{Phase, Warp};
use crate::fermi::cut::Home;
use crate::fermi::kernel::Block;
use crate::fermi::launch::Work;
use crate::layout::Node;

impl<'a> Warp<'a> {
    /// All lanes that hold a ray walk to the next subtree of it, or to its end.
    pub(super) fn walk(&mut self, batch: &mut Batch) {
        let Some(mut stay) = self.stay.take() else { return };
        let all = holding(&stay);
        batch.segment(Block::Walk, all);
        let resuming = lanes(&stay, all, |held| held.resumes());
        if resuming != 0 {
            batch.segment(Block::Links, resuming);
            batch.access(Access::Load, addresses(&stay, resuming).map(|above| self.links(above)), LOAD);
        }
        let mut walking = lanes(&stay, all, |held| held.resumes() || self.at_top(held));
        while walking != 0 {
            self.turn(batch, &mut stay, walking);
            walking = lanes(&stay, walking, |held| held.resumes() || self.at_top(held));
        }
        self.choose(batch, &mut stay);
        self.phase = if self.launch.work.is_schedule() { Phase::Exit } else { Phase::Take };
        self.stay = Some(stay);
    }

    /// One turn of the walk: lanes at an end climb to where a child is pending, then lanes at a node visit it.
    fn turn(&self, batch: &mut Batch, stay: &mut Stay<'a>, walking: u32) {
        let Some(cut) = self.launch.workload.cut else { return };
        let resuming = lanes(stay, walking, |held| !held.descends);
        if resuming != 0 {
            let mut goal = [None; LANES];
            for lane in bits(resuming) {
                goal[lane] = stay.held[lane].and_then(|held| held.rest.first().and_then(|&step| cut.above(step)));
            }
            let mut climbing = resuming;
            loop {
                climbing = bits(climbing)
                    .filter(|&lane| {
                        stay.held[lane].is_some_and(|held| goal[lane].is_some_and(|goal| goal != held.above))
                    })
                    .fold(0, |mask, lane| mask | 1 << lane);
                if climbing == 0 {
                    break;
                }
                for lane in bits(climbing) {
                    if let Some(held) = &mut stay.held[lane] {
                        held.above = cut.top()[held.above as usize].parent;
                    }
                }
                batch.segment(Block::Climb, climbing);
                batch.access(Access::Load, addresses(stay, climbing).map(|above| self.links(above)), LOAD);
            }
            batch.segment(Block::Resume, resuming);
            bits(resuming).for_each(|lane| stay.held[lane].iter_mut().for_each(|held| held.descends = true));
        }
        let visiting = lanes(stay, walking, |held| self.at_top(held));
        if visiting != 0 {
            for lane in bits(visiting) {
                if let Some(held) = &mut stay.held[lane]
                    && let Some(Home::Top(index)) = held.rest.first().map(|&step| cut.home(step))
                {
                    (held.above, held.rest, held.own) = (index, &held.rest[1..], held.own - 1);
                    held.descends = held.rest.first().is_some_and(|&step| cut.above(step) == Some(index));
                }
            }
            batch.segment(Block::Top, visiting);
            for part in 0..bytes::<Node>() / LOAD {
                let nodes = addresses(stay, visiting).map(|above| self.layout.top(above) + part * LOAD);
                batch.access(Access::Load, nodes, LOAD);
            }
        }
        batch.segment(Block::WalkEnd, walking);
    }

    /// Address of the links of a node of the top tree.
    fn links(&self, node: u32) -> u64 {
        self.layout.top(node) + bytes::<Node>() - LOAD
    }

    /// Whether the ray's next step is in the top tree.
    fn at_top(&self, held: &Held) -> bool {
        let home = |&step| self.launch.workload.cut.map(|cut| cut.home(step));
        matches!(held.rest.first().and_then(home), Some(Home::Top(_)))
    }
}

impl Work<'_> {
    fn is_schedule(&self) -> bool {
        matches!(self, Work::Schedule)
    }
}

/// Of `lanes`, those whose ray is as asked.
fn lanes(stay: &Stay, lanes: u32, test: impl Fn(&Held) -> bool) -> u32 {
    bits(lanes).filter(|&lane| stay.held[lane].as_ref().is_some_and(&test)).fold(0, |mask, lane| mask | 1 << lane)
}

/// Top nodes at which the rays of `lanes` stand.
fn addresses<'s>(stay: &'s Stay, lanes: u32) -> impl Iterator<Item = u32> + Clone + 's {
    bits(lanes).filter_map(|lane| stay.held[lane].as_ref().map(|held| held.above))
}
