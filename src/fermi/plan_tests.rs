//! The modelled migration is the twin's, which is the kernel's.

use std::collections::HashMap;

use super::*;
use crate::bvh::{Bvh, Owners, Partition, Policy};
use crate::fermi::kernel::Block;
use crate::fermi::launch::Stage;
use crate::fermi::machine::Machine;
use crate::fermi::result::{Accounting, Fidelity};
use crate::fermi::simt::{Batch, LANES, Layout, Warp};
use crate::layout::Ray;
use crate::scene::procedural;
use crate::trace::Query;
use crate::trace::steps::record_steps;
use crate::twin::migrate;
use glam::Vec3;

const SMS: u32 = 4;

fn rays(bvh: &Bvh, count: u32) -> Vec<Ray> {
    let (low, high) = bvh.bounds;
    (0..count)
        .map(|i| {
            let fraction = |k: u32| (i.wrapping_mul(k) >> 8 & 0xffff) as f32 / 65536.0;
            let origin = low + (high - low) * Vec3::new(fraction(2_654_435_761), fraction(40_503), fraction(97));
            let direction = Vec3::new(fraction(31) - 0.5, fraction(69_069) - 0.5, fraction(1_103_515_245) - 0.4);
            Ray { origin: origin.into(), t_min: 0.0, direction: direction.normalize().into(), t_max: 1.0e30 }
        })
        .collect()
}

fn kernels() -> Kernels {
    let named = |name| Kernel::named(name, &[]).unwrap();
    Kernels { schedule: named("migrate-schedule"), queue: named("migrate-queue"), subtree: named("migrate-subtree") }
}

/// Lanes that ran each block in all warps of `launches`.
fn lanes_by_block(launches: &[Launch]) -> HashMap<Block, u64> {
    let mut lanes = HashMap::new();
    for launch in launches {
        let layout = Layout::new(&launch.workload, 1 << 16);
        for block in 0..launch.blocks() {
            for warp in 0..launch.warps_of(block) {
                let mut run = Warp::new(launch, layout, block, warp, (warp * LANES) as u64);
                let mut batch = Batch::default();
                loop {
                    run.advance(&mut batch);
                    if batch.segments.is_empty() {
                        break;
                    }
                    for segment in &batch.segments {
                        *lanes.entry(segment.block).or_default() += u64::from(segment.lanes);
                    }
                    assert!(batch.memory.iter().all(|op| op.lines.0 < op.lines.1), "an access of nothing");
                }
            }
        }
    }
    lanes
}

#[test]
fn rays_go_through_the_queues_of_the_twin_and_do_what_it_counts() {
    let scene = procedural::build("room", 3000, 1).unwrap();
    let bvh = Bvh::build(&scene.positions, Default::default()).unwrap();
    let rays = rays(&bvh, 3000);
    let children: Vec<[u32; 2]> = bvh.nodes.iter().map(|node| node.child).collect();
    for (policy, owners) in
        [("bytes:8KiB", Owners::Adjacent), ("level:3", Owners::Scattered), ("sah:4KiB", Owners::Adjacent)]
    {
        for query in [Query::Closest, Query::Any] {
            let (_, trace) = record_steps(&bvh, &rays, query);
            let partition = Partition::new(&bvh, policy.parse::<Policy>().unwrap(), owners, SMS).unwrap();
            let cut = Cut::new(&partition, &children, bvh.references());
            let workload =
                Workload { trace: &trace, children: &children, triangles: bvh.references(), cut: Some(&cut) };
            let modelled = Migration::of(&workload, &cut, true);

            let machine = migrate::Machine { bvh: &bvh, partition: &partition, warps_per_sm: 2, quota: u32::MAX };
            let mut twin = migrate::Migration::<()>::schedule(machine, &rays);
            for round in &modelled.rounds {
                let visits = match query {
                    Query::Closest => twin.round::<false>(),
                    Query::Any => twin.round::<true>(),
                };
                let theirs: Vec<(u32, u32)> = visits.iter().map(|visit| (visit.ray, visit.subtree)).collect();
                let ours: Vec<(u32, u32)> = round.queue.iter().map(|visit| (visit.ray, visit.subtree)).collect();
                assert!(ours == theirs, "{policy} {query:?}");
            }
            assert_eq!(twin.queued(), 0);

            let kernels = kernels();
            let lanes = lanes_by_block(&modelled.launches(workload, &kernels));
            let of = |block| lanes.get(&block).copied().unwrap_or(0);
            let sum = |of: fn(&crate::layout::RayCounters) -> u32| -> u64 {
                twin.counters.iter().map(|counters| u64::from(of(counters))).sum()
            };
            assert_eq!(of(Block::Node), sum(|c| c.node_visits - c.top_visits));
            assert_eq!(of(Block::Triangle), sum(|c| c.triangle_tests));
            assert_eq!(of(Block::Leaf), sum(|c| c.leaf_visits));
            assert_eq!(of(Block::Top), sum(|c| c.top_visits));
            assert_eq!(of(Block::Climb), sum(|c| c.climbs));
            assert_eq!(of(Block::Enter), sum(|c| c.subtrees));
            assert_eq!(of(Block::Take) as usize, modelled.entries());
            assert_eq!(of(Block::Store) as usize, modelled.entries() + rays.len());
            let first = modelled.rounds.first().map_or(0, |round| round.queue.len());
            assert_eq!(modelled.entries() as u64, first as u64 + sum(|c| c.migrations));
        }
    }
}

#[test]
fn free_visits_are_all_steps_in_subtrees_and_nothing_else() {
    let scene = procedural::build("room", 3000, 1).unwrap();
    let bvh = Bvh::build(&scene.positions, Default::default()).unwrap();
    let (_, trace) = record_steps(&bvh, &rays(&bvh, 2000), Query::Closest);
    let children: Vec<[u32; 2]> = bvh.nodes.iter().map(|node| node.child).collect();
    let partition = Partition::new(&bvh, "bytes:8KiB".parse().unwrap(), Owners::Adjacent, SMS).unwrap();
    let cut = Cut::new(&partition, &children, bvh.references());
    let workload = Workload { trace: &trace, children: &children, triangles: bvh.references(), cut: Some(&cut) };
    let kernel = Kernel::named("while-while", &[]).unwrap();
    let below = trace.steps.iter().filter(|&&step| matches!(cut.home(step), Home::Subtree(_))).count() as u64;
    for grouping in [Grouping::Queued, Grouping::Owned] {
        let visits = FreeVisits::of(&workload, &cut, grouping, kernel.threads);
        let lanes = lanes_by_block(&[visits.launch(workload, &kernel)]);
        assert_eq!(lanes[&Block::Node] + lanes[&Block::Leaf], below, "{grouping:?}");
        assert!(!lanes.contains_key(&Block::Entry) && !lanes.contains_key(&Block::Exit));
    }
}

#[test]
fn all_fidelities_replay_a_migration_to_its_end() {
    let scene = procedural::build("room", 3000, 1).unwrap();
    let bvh = Bvh::build(&scene.positions, Default::default()).unwrap();
    let (_, trace) = record_steps(&bvh, &rays(&bvh, 1500), Query::Closest);
    let children: Vec<[u32; 2]> = bvh.nodes.iter().map(|node| node.child).collect();
    let machine = Machine::named("gtx480", &["sms=4".to_owned()]).unwrap();
    let partition = Partition::new(&bvh, "bytes:8KiB".parse().unwrap(), Owners::Adjacent, SMS).unwrap();
    let cut = Cut::new(&partition, &children, bvh.references());
    let workload = Workload { trace: &trace, children: &children, triangles: bvh.references(), cut: Some(&cut) };
    let migration = Migration::of(&workload, &cut, true);
    let kernels = kernels();
    let launches = migration.launches(workload, &kernels);
    let [a, b, c] = [Fidelity::Counters, Fidelity::Caches, Fidelity::Cycles]
        .map(|fidelity| crate::fermi::predict(&machine, &launches, fidelity, Accounting::Full).unwrap());
    assert_eq!((a.instructions, a.l1.counts.accesses), (c.instructions, c.l1.counts.accesses));
    assert_eq!((b.instructions, b.l1.counts.accesses), (c.instructions, c.l1.counts.accesses));
    for p in [a, b, c] {
        assert!((p.cpi.total() / p.cycles as f64 - 1.0).abs() < 1e-3, "{:?}", p.cpi);
        assert_eq!(p.stages.iter().map(|stage| stage.launches).sum::<usize>(), launches.len());
        assert!(p.stages.iter().any(|stage| stage.stage == Stage::Queue && stage.cycles > 0));
    }
}
