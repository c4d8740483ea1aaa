//! What a launch needs of the caches, so that no more is replayed.
//!
//! A cache that is asked for no more lines of any set than it has ways never replaces one: the first touch of a line
//! misses and all later ones hit, in whatever order they come. There is nothing to replay in it then, and a cache with a
//! place of its own for each line gives the same misses without a search. Which lines a launch touches is known after a
//! pass with such caches; if the real ones hold them all, that pass is the answer, and exact. With only first touches
//! below, little waits anywhere, so the second pass of the replay, which adds queues, can often be left out as well: how
//! much it could add is known too.

use std::time::Instant;

use super::caches::{Room, part, pass_in};
use super::launch::Launch;
use super::machine::{LINE, Machine};
use super::occupancy::launchable;
use super::result::{Accounting, Fidelity, Prediction};
use super::sampled::{Effort, Request, Skipped};
use super::simt::{LANES, Layout};
use super::times::Times;
use crate::Result;
use crate::layout::{Hit, Ray};
use crate::shared::LEAF_BIT;

/// Lines that were asked for of a cache that had room for all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Demand {
    /// So many.
    pub lines: u64,
    /// The real cache's.
    pub room: u64,
    /// Whether no set of the real one is asked for more than its ways.
    pub fits: bool,
}

impl Demand {
    /// `sets`: number of the real cache's set of each line, below `count`.
    pub(super) fn new(sets: impl Iterator<Item = usize>, count: usize, ways: u64) -> Demand {
        let mut asked = vec![0; count];
        sets.for_each(|set| asked[set] += 1);
        let (lines, most) = (asked.iter().sum(), asked.into_iter().max().unwrap_or(0));
        Demand { lines, room: count as u64 * ways, fits: most <= ways }
    }

    /// Of the L1 and of another of the same size, the larger.
    pub(super) fn or(self, other: Demand) -> Demand {
        Demand { lines: self.lines.max(other.lines), fits: self.fits && other.fits, ..self }
    }

    fn skipped(&self, what: &'static str, whose: &str) -> Skipped {
        let Demand { lines, room, .. } = self;
        let why = format!("the {lines} lines asked of {whose} fit the sets of its {room}, so only first touches miss");
        Skipped { what, why }
    }
}

/// Places for the lines of caches that may hold all; none of those that cannot, because there are too many rays or, for
/// an L1, too large a tree.
fn room(machine: &Machine, launch: &Launch) -> Result<Room> {
    let slots = launch.slots(launchable(machine, launch)?.blocks);
    let resident = slots * launch.block_threads().next_multiple_of(LANES) * machine.sms as usize;
    let layout = Layout::new(&launch.workload, resident as u64);
    let places = layout.places(levels(launch.workload.children) + 1);
    let lines = |bytes: usize| bytes as u64 / LINE;
    let rays = launch.rays();
    let of_l2 = lines(rays * (size_of::<Ray>() + size_of::<Hit>()));
    let of_l1 = layout.tree_lines().count() as u64 + lines(rays * size_of::<Ray>()) / u64::from(machine.sms);
    let l1 = machine.l1.sets() * machine.l1.ways;
    Ok(Room { l1: (of_l1 <= l1).then_some(places), l2: (of_l2 <= machine.l2.lines()).then_some(places) })
}

/// Levels of the tree.
fn levels(children: &[[u32; 2]]) -> u32 {
    let (mut deepest, mut stack) = (0, vec![(0, 1)]);
    while let Some((node, depth)) = stack.pop() {
        deepest = deepest.max(depth);
        let inner = children.get(node as usize).into_iter().flatten().filter(|&&child| child & LEAF_BIT == 0);
        stack.extend(inner.map(|&child| (child, depth + 1)));
    }
    deepest
}

/// Predicts a launch with a thread a ray, if a cache holds all that it can touch; none if not. Its rays were traced and
/// recorded in `seconds_recording`.
///
/// # Errors
/// [`crate::Error::Usage`] if no block fits a multiprocessor.
pub fn predict(
    machine: &Machine,
    launch: &Launch,
    seconds_recording: f64,
    request: &Request,
) -> Result<Option<Prediction>> {
    let room = room(machine, launch)?;
    if room.l1.is_none() && room.l2.is_none() {
        return Ok(None);
    }
    let start = Instant::now();
    let unloaded = Times::unloaded(machine);
    // A tree may fit the L1 and what its rays touch may not; the L2 can still hold it.
    let without_l1 = Room { l1: None, ..room };
    let rooms = if room.l1.is_some() && room.l2.is_some() { vec![room, without_l1] } else { vec![room] };
    let mut fitting = None;
    for room in rooms {
        let before = start.elapsed().as_secs_f64();
        let (outcome, demands) = pass_in(machine, launch, unloaded, room)?;
        if all_fit(&demands) {
            fitting = Some((room, outcome, demands, start.elapsed().as_secs_f64() - before));
            break;
        }
    }
    let Some((room, mut outcome, [l1, l2], seconds_pass)) = fitting else { return Ok(None) };
    let l1 = l1.map(|demand| demand.skipped("replay of the L1", "a multiprocessor"));
    let mut skipped: Vec<Skipped> =
        l1.into_iter().chain(l2.map(|demand| demand.skipped("replay of the L2", "it"))).collect();
    let loaded = unloaded.with_queues(machine, &outcome.load());
    // Each miss waits once in each queue at most, and blocks in the same place follow each other.
    let wait = loaded.traffic - unloaded.traffic + loaded.dram - unloaded.dram;
    let misses = outcome.spans.iter().map(|span| span.l1.misses).max().unwrap_or(0);
    let waves = launch.blocks().div_ceil(launch.slots(launchable(machine, launch)?.blocks) * machine.sms as usize);
    let added = waves as f64 * misses as f64 * wait;
    let (times, reached) = if added <= request.tolerance * outcome.cycles {
        let share = added / outcome.cycles.max(1.0);
        let why = format!("queues add at most {:.2} % to the cycles", 100.0 * share);
        skipped.push(Skipped { what: "second pass, with queues", why });
        (unloaded, share)
    } else {
        let (again, demands) = pass_in(machine, launch, loaded, room)?;
        // Other latencies may bring blocks to other multiprocessors.
        if !all_fit(&demands) {
            return Ok(None);
        }
        outcome = again;
        (loaded, 0.0)
    };
    let parts = [part(machine, launch, times, &outcome)?];
    let seconds_model = start.elapsed().as_secs_f64();

    let prediction = Prediction::of(machine, &[*launch], &parts, (Fidelity::Sampled, Accounting::Full));
    let spent = seconds_recording + seconds_model;
    let saving_estimated = (seconds_recording + 2.0 * seconds_pass).max(spent) / spent;
    let effort =
        Effort { skipped, seconds_recording, seconds_model, saving_estimated, ..effort(request, launch, reached) };
    Ok(Some(with_effort(prediction, effort)))
}

fn all_fit(demands: &[Option<Demand>]) -> bool {
    demands.iter().flatten().all(|demand| demand.fits)
}

/// The prediction of a launch of rays that a picture does not have: of no rays, for the reason given. `rays` is their
/// number.
///
/// # Errors
/// [`crate::Error::Usage`] if no block fits a multiprocessor.
pub fn left_out(
    machine: &Machine,
    launch: &Launch,
    rays: usize,
    request: &Request,
    skipped: Skipped,
) -> Result<Prediction> {
    let launches = [*launch];
    let parts = super::caches::replay(machine, &launches)?;
    let prediction = Prediction::of(machine, &launches, &parts, (Fidelity::Sampled, Accounting::Full));
    let warps = rays.div_ceil(LANES);
    let effort = Effort { sampled_warps: 0, warps, skipped: vec![skipped], ..effort(request, launch, 0.0) };
    Ok(with_effort(prediction, effort))
}

/// Nothing spent and nothing left out yet.
fn effort(request: &Request, launch: &Launch, reached: f64) -> Effort {
    let warps = launch.rays().div_ceil(LANES);
    Effort {
        asked: request.tolerance,
        reached,
        met: true,
        interval: [0.0; 2],
        sampled_warps: warps,
        warps,
        skipped: Vec::new(),
        seconds_recording: 0.0,
        seconds_model: 0.0,
        saving_estimated: f64::INFINITY,
    }
}

/// Only cycles may be more than predicted.
fn with_effort(prediction: Prediction, effort: Effort) -> Prediction {
    let cycles = prediction.cycles as f64;
    let interval = [cycles, cycles * (1.0 + effort.reached)];
    let [l1, l2] = [prediction.l1.miss_rate, prediction.l2.miss_rate].map(|rate| [rate; 2]);
    prediction.sampled([interval, l1, l2], Effort { interval, ..effort })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::Bvh;
    use crate::fermi::caches;
    use crate::fermi::kernel::Kernel;
    use crate::fermi::launch::{Stage, Work, Workload};
    use crate::render::rays::{RayKind, twin_rays};
    use crate::render::settings::Settings;
    use crate::report::experiment::{Traceable, Traversal};
    use crate::scene::{self, builtin, tables::Tables};

    /// Camera rays through the first `triangles` triangles of the Cornell box, and the answers with a tolerance and of the
    /// full replay.
    fn both(triangles: usize, size: (u32, u32), tolerance: f64) -> (Option<Prediction>, Prediction) {
        let scene = scene::load_slice("cornell", builtin::builtin("cornell").unwrap()).unwrap();
        let camera = scene::select_camera(&scene, None).unwrap();
        let bvh = Bvh::build(&scene.positions[..triangles], Default::default()).unwrap();
        let settings = Settings { width: size.0, height: size.1, ..Settings::default() };
        let rays = twin_rays(&bvh, &Tables::new(&scene), &settings.frame(&camera), RayKind::Primary);
        let children: Vec<[u32; 2]> = bvh.nodes.iter().map(|node| node.child).collect();
        let source =
            Traceable { traversal: Traversal::Scene(&bvh, RayKind::Primary.query()), children: &children, rays: &rays };
        let machine = Machine::named("gtx480", &["l1.kib=48".to_owned()]).unwrap();
        let kernel = Kernel::named("while-while", &[]).unwrap();
        let trace = source.record(kernel.loops);
        let workload = Workload { trace: &trace, children: &children, triangles, cut: None };
        let launches =
            [Launch { kernel: &kernel, workload, work: Work::Rays, virtual_caches: false, stage: Stage::Traverse }];
        let request = Request { tolerance, time_limit: None, seed: 1 };
        let found = predict(&machine, &launches[0], 0.0, &request).unwrap();
        let parts = caches::replay(&machine, &launches).unwrap();
        (found, Prediction::of(&machine, &launches, &parts, (Fidelity::Sampled, Accounting::Full)))
    }

    fn skipped(prediction: &Prediction) -> Vec<&'static str> {
        prediction.tolerance.iter().flat_map(|effort| &effort.skipped).map(|skipped| skipped.what).collect()
    }

    #[test]
    fn a_launch_that_fits_both_caches_is_not_replayed_in_them_and_comes_out_the_same() {
        let (found, full) = both(12, (64, 48), 1e-9);
        let found = found.unwrap();
        assert_eq!(skipped(&found)[..2], ["replay of the L1", "replay of the L2"]);
        assert_eq!((found.cycles, found.l1.counts, found.l2.counts), (full.cycles, full.l1.counts, full.l2.counts));
        assert!(full.l1.counts.misses > 0 && full.l1.miss_rate < 0.5);
    }

    #[test]
    fn a_launch_that_fits_the_l2_is_not_replayed_there_and_comes_out_the_same() {
        let (found, full) = both(5712, (64, 48), 1e-9);
        let found = found.unwrap();
        assert_eq!(skipped(&found)[0], "replay of the L2");
        assert_eq!((found.cycles, found.l1.counts, found.l2.counts), (full.cycles, full.l1.counts, full.l2.counts));
    }

    #[test]
    fn the_second_pass_is_left_out_where_queues_add_less_than_the_tolerance() {
        const TOLERANCE: f64 = 0.1;
        for (triangles, size) in [(12, (64, 48)), (500, (48, 64)), (5712, (64, 48)), (5712, (56, 42))] {
            let (found, full) = both(triangles, size, TOLERANCE);
            let found = found.unwrap();
            assert_eq!(skipped(&found).last(), Some(&"second pass, with queues"));
            assert!(found.tolerance.as_ref().unwrap().reached <= TOLERANCE);
            // Without queues, warps come in another order, so misses of a replayed L1 may differ a little.
            let off = |a: f64, b: f64| (a / b - 1.0).abs();
            let errors = [off(found.cycles as f64, full.cycles as f64), off(found.l1.miss_rate, full.l1.miss_rate)];
            assert!(errors.iter().all(|&error| error <= TOLERANCE), "{triangles} triangles: {errors:?}");
        }
    }

    #[test]
    fn more_rays_than_the_l2_has_lines_for_are_left_to_samples() {
        assert!(both(12, (256, 192), 0.5).0.is_none());
    }

    #[test]
    fn a_set_that_is_asked_for_more_than_its_ways_does_not_fit() {
        let demand = |sets: &[usize]| Demand::new(sets.iter().copied(), 2, 2);
        assert_eq!(demand(&[0, 1, 0, 1]), Demand { lines: 4, room: 4, fits: true });
        assert_eq!(demand(&[0, 0, 0]), Demand { lines: 3, room: 4, fits: false });
    }

    #[test]
    fn a_tree_has_as_many_levels_as_its_deepest_path() {
        assert_eq!(levels(&[[1, 2], [LEAF_BIT, LEAF_BIT], [3, LEAF_BIT], [LEAF_BIT, LEAF_BIT]]), 3);
        assert_eq!(levels(&[]), 1);
    }
}
