//! Steps of warps whose lanes put leaves off: Aila and Laine's speculative traversal (2009, section 3.2). A lane that
//! has found a leaf goes on with the next node from its stack until all lanes have one, or until it finds a second.
//! What it visits then, the leaf's triangles might have spared it: so the steps depend on the warp, and are more than
//! those of a traversal that tests each leaf at once. The hits are the same.

use super::Query;
use super::steps::StepTrace;
use crate::layout::{Hit, Ray, RayCounters};
use crate::shared::{LEAF_COUNT_MASK, LEAF_COUNT_SHIFT, LEAF_FIRST_MASK, LINK_DONE, STEP_PUSHED, WARP};
use crate::twin::trace::{finished, missed, prepare};
use crate::twin::traverse::{Cursor, PreparedRay, Tree, Uncounted, is_node, met_children};
use crate::twin::triangle::intersect;

/// Hits and steps of `rays`, of which each [`WARP`] in turn are a warp. A leaf's step is where it was found, before
/// the nodes visited while it waited.
pub fn record_speculative(tree: &impl Tree, rays: &[Ray], query: Query) -> (Vec<Hit>, StepTrace) {
    StepTrace::record_groups(rays, WARP as usize, |rays| match query {
        Query::Closest => warp::<false>(tree, rays),
        Query::Any => warp::<true>(tree, rays),
    })
}

struct Lane<'a> {
    ray: PreparedRay<'a>,
    cursor: Cursor,
    /// Leaf found and put off.
    postponed: Option<u32>,
    hit: Hit,
    steps: Vec<u32>,
}

impl Lane<'_> {
    fn at_node(&self) -> bool {
        is_node(self.cursor.link)
    }

    fn at_leaf(&self) -> bool {
        !is_node(self.cursor.link) && self.cursor.link != LINK_DONE
    }

    fn has_leaf(&self) -> bool {
        self.postponed.is_some() || self.at_leaf()
    }

    fn pop(&mut self) {
        self.cursor.link = self.cursor.pop::<Uncounted>(&mut RayCounters::default());
    }

    fn visit(&mut self, tree: &impl Tree) {
        let link = self.cursor.link;
        let (near, far) = met_children(&tree.node(link), &self.ray, self.hit.t);
        if far != LINK_DONE {
            self.cursor.push(far);
        }
        self.steps.push(link | if far != LINK_DONE { STEP_PUSHED } else { 0 });
        if near != LINK_DONE {
            self.cursor.link = near;
        } else {
            self.pop();
        }
    }

    fn put_off(&mut self) {
        self.postponed = Some(self.cursor.link);
        self.steps.push(self.cursor.link);
        self.pop();
    }

    /// Tests the leaf put off, or else the one that the lane is at.
    fn test<const ANY_HIT: bool>(&mut self, tree: &impl Tree) {
        let leaf = self.postponed.take().unwrap_or_else(|| {
            let leaf = self.cursor.link;
            self.steps.push(leaf);
            self.pop();
            leaf
        });
        let first = (leaf & LEAF_FIRST_MASK) as usize;
        let count = (leaf >> LEAF_COUNT_SHIFT & LEAF_COUNT_MASK) as usize;
        for triangle in &tree.triangles()[first..first + count] {
            intersect(self.ray.ray, &self.ray.box_ray, &self.ray.shear, triangle, &mut self.hit);
        }
        if ANY_HIT && self.hit.is_hit() {
            self.cursor = Cursor::at(LINK_DONE);
        }
    }
}

fn warp<const ANY_HIT: bool>(tree: &impl Tree, rays: &[Ray]) -> Vec<(Hit, Vec<u32>)> {
    let lane = |ray| Lane {
        ray: prepare(tree, ray),
        cursor: Cursor::at(if ray.is_live() { 0 } else { LINK_DONE }),
        postponed: None,
        hit: missed(ray),
        steps: Vec::new(),
    };
    let mut lanes: Vec<Lane> = rays.iter().map(lane).collect();
    while lanes.iter().any(|lane| lane.cursor.link != LINK_DONE || lane.postponed.is_some()) {
        // Lanes that have left the loop over nodes wait for the others.
        let mut inside: Vec<bool> = lanes.iter().map(Lane::at_node).collect();
        while lanes.iter().zip(&inside).any(|(lane, &inside)| inside && lane.postponed.is_none()) {
            for (lane, inside) in lanes.iter_mut().zip(&mut inside).filter(|(_, inside)| **inside) {
                lane.visit(tree);
                if lane.at_leaf() && lane.postponed.is_none() {
                    lane.put_off();
                }
                *inside = lane.at_node();
            }
        }
        let mut inside: Vec<bool> = lanes.iter().map(Lane::has_leaf).collect();
        while inside.contains(&true) {
            for (lane, inside) in lanes.iter_mut().zip(&mut inside).filter(|(_, inside)| **inside) {
                lane.test::<ANY_HIT>(tree);
                *inside = lane.has_leaf();
            }
        }
    }
    lanes.into_iter().map(|lane| (finished::<ANY_HIT>(lane.hit), lane.steps)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::Bvh;
    use crate::render::rays::{RayKind, twin_rays};
    use crate::render::settings::Settings;
    use crate::scene::tables::Tables;
    use crate::scene::{self, Scene, builtin};
    use crate::shared::LEAF_BIT;
    use crate::trace::steps::record_steps;

    fn courtyard() -> Scene {
        scene::load_slice("courtyard", builtin::builtin("courtyard").unwrap()).unwrap()
    }

    /// Rays of a kind in the courtyard, traced both ways.
    fn both(kind: RayKind) -> (Vec<Ray>, [(Vec<Hit>, StepTrace); 2]) {
        let scene = courtyard();
        let camera = scene::select_camera(&scene, None).unwrap();
        let bvh = Bvh::build(&scene.positions, Default::default()).unwrap();
        let settings = Settings { width: 64, height: 48, ao_radius: 2.0, ..Settings::default() };
        let rays = twin_rays(&bvh, &Tables::new(&scene), &settings.frame(&camera), kind);
        let found = [record_steps(&bvh, &rays, kind.query()), record_speculative(&bvh, &rays, kind.query())];
        (rays, found)
    }

    #[test]
    fn hits_are_those_of_a_ray_alone_and_no_node_is_missed() {
        for kind in RayKind::ALL {
            let (rays, [(hits, alone), (in_warps, trace)]) = both(kind);
            assert!(hits.iter().any(Hit::is_hit), "{}", kind.name());
            assert_eq!(hits, in_warps, "{}", kind.name());
            assert!(trace.steps.len() > alone.steps.len(), "{}: no node is visited in vain", kind.name());
            for ray in 0..rays.len() {
                let nodes = |trace: &StepTrace| trace.of(ray).iter().filter(|&step| step & LEAF_BIT == 0).count();
                assert!(nodes(&trace) >= nodes(&alone), "{} ray {ray}", kind.name());
            }
        }
    }

    /// Where no other lane searches, none goes on: each ray in a warp of its own takes the steps of a ray alone.
    #[test]
    fn a_lone_lane_tests_its_leaf_at_once() {
        let (rays, [(_, alone), _]) = both(RayKind::Primary);
        let bvh = Bvh::build(&courtyard().positions, Default::default()).unwrap();
        for ray in (0..rays.len()).step_by(37) {
            let (_, trace) = record_speculative(&bvh, &rays[ray..=ray], Query::Closest);
            assert_eq!(trace.of(0), alone.of(ray));
        }
    }
}
