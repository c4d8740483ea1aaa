//! The L1 of virtual SMs counts the same in a kernel that runs warps in lockstep and in the host's replay of step
//! traces: two accounts of divergence, coalescing and replacement, one by a device, one by the Fermi model.
#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod common;

use caribou::report::verify::{VIRTUAL_L1S, verify_virtual_l1};
use caribou::trace::Query;

#[test]
fn gpu_virtual_l1_counts_what_the_replay_counts() {
    let Some(gpu) = common::gpu() else { return };
    for (name, scene) in common::small_scenes() {
        let bvh = common::bvh(&scene);
        // More than the SMs hold at a time, the last warp not full; a few where a ray takes thousands of steps.
        let rays = common::rays_around(&scene, if name == "needles" { 200 } else { 2_013 });
        for query in [Query::Closest, Query::Any] {
            for (l1, machine) in &VIRTUAL_L1S {
                let verdict = verify_virtual_l1(&gpu, &bvh, (query, &rays), machine).unwrap();
                assert!(verdict.cases > 10_000);
                assert_eq!(verdict.mismatches, 0, "{name}, {query:?}, L1 of {l1}");
            }
        }
    }
}
