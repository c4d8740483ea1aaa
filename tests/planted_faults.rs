//! Each fault that migration is guarded against is planted in a kernel once, and found: by the conservation of
//! rays, or because hits or counters differ from the twin's.
#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod common;

use caribou::layout::{Hit, RayCounters};
use caribou::report::verify::{VIRTUAL_L1S, verify_virtual_l1};
use caribou::trace::{MachineOptions, Query, RayBuffers, Strategy, Stream, Tracer, TracerOptions, TwinTracer};
use caribou::vulkan::{DeviceKind, Place};
use common::faults::{Fault, gpu_with_fault};

/// How a fault shows.
#[derive(Debug, PartialEq)]
enum Finding {
    Nothing,
    /// The run stopped: rays were not conserved.
    Conservation,
    Hits,
    Counters,
}

/// Kernels of strategy `migrate` and the sort.
const KERNELS: [&str; 8] = [
    "schedule",
    "schedule_cpu",
    "migrate",
    "migrate_cpu",
    "queue_count",
    "queue_prefix",
    "queue_scatter",
    "queue_shares",
];

/// What the fault comes to; nothing at all without a device.
fn check(fault: Fault) -> Option<Finding> {
    let (gpu, _folder) = gpu_with_fault(&KERNELS, fault)?;
    let scene = caribou::scene::procedural::build("forest", 4_000, 1).unwrap();
    let bvh = common::bvh(&scene);
    let machine = MachineOptions { partition: "bytes:4KiB".parse().unwrap(), sms: 4, ..MachineOptions::default() };
    let options = TracerOptions { strategy: Strategy::Migrate, machine, ..TracerOptions::default() };
    let rays = common::rays_around(&scene, 2_000);
    let twin = TwinTracer::new(&bvh, &options).unwrap().trace(Query::Closest, &rays).unwrap();

    let tracer = Tracer::new(&gpu, &bvh, &options, rays.len() as u32).unwrap();
    let count = rays.len();
    let rays = gpu.upload("rays", &rays).unwrap();
    let hits = gpu.buffer("hits", (size_of::<Hit>() * count) as u64, Place::Device).unwrap();
    let counters = gpu.buffer("counters", (size_of::<RayCounters>() * count) as u64, Place::Device).unwrap();
    let buffers = RayBuffers::new(&rays, &hits).counted(&counters);
    Some(match tracer.trace(&mut Stream::new(&gpu), "trace", Query::Closest, &buffers, count as u32) {
        Err(error) => {
            assert!(error.to_string().contains("conservation of rays"), "{error}");
            assert_eq!(error.exit_code(), 1);
            Finding::Conservation
        }
        Ok(_) if gpu.download::<Hit>(&hits, 0..count).unwrap() != twin.hits => Finding::Hits,
        Ok(_) if gpu.download::<RayCounters>(&counters, 0..count).unwrap() != twin.counters => Finding::Counters,
        Ok(report) if report != twin.migration => Finding::Counters,
        Ok(_) => Finding::Nothing,
    })
}

/// By how much counts of the virtual L1 differ from the replay's; nothing at all without a device.
fn check_virtual_l1(fault: Fault) -> Option<u64> {
    let (gpu, _folder) = gpu_with_fault(&["virtual_l1"], fault)?;
    let scene = caribou::scene::procedural::build("room", 4_000, 1).unwrap();
    let (bvh, rays) = (common::bvh(&scene), common::rays_around(&scene, 2_000));
    Some(verify_virtual_l1(&gpu, &bvh, (Query::Closest, &rays), &VIRTUAL_L1S[0].1).unwrap().mismatches)
}

macro_rules! planted {
    ($($(#[$about:meta])* $name:ident: $file:literal, $original:literal => $planted:literal, $finding:ident;)*) => {
        $(
            $(#[$about])*
            #[test]
            fn $name() {
                if let Some(finding) = check(Fault { file: $file, original: $original, planted: $planted }) {
                    assert_eq!(finding, Finding::$finding);
                }
            }
        )*
    };
}

planted! {
    /// The check itself finds nothing where there is nothing.
    planted_no_fault: "queue_scatter.comp", "sorted[place] = entry;" => "sorted[place] = entry; ", Nothing;
    planted_dropped_record: "queue_scatter.comp",
        "sorted[place] = entry;" => "if (entry.ray != 777u) sorted[place] = entry;", Conservation;
    planted_doubled_record: "queue_scatter.comp",
        "sorted[place] = entry;" => "if (entry.ray == 777u) entry.ray = entries[0].ray; sorted[place] = entry;", Conservation;
    planted_record_in_two_queues: "include/migrate.glsl",
        "queue[at].subtree = travel.subtree;" => "queue[at].subtree = entry.ray == 777u ? 0u : travel.subtree;", Conservation;
    planted_skipped_barrier: "queue_prefix.comp",
        ": 0u;\n        barrier();" => ": 0u;", Conservation;
    planted_wrong_trail: "include/top_tree.glsl",
        "trail = trail_above(trail, level);" => "trail = trail_above(trail, max(level, 1u) - 1u);", Hits;
    planted_stale_best_hit: "include/migrate.glsl",
        "hits[i] = is_end ? finished(hit) : hit;" => "if (is_end) hits[i] = finished(hit);", Hits;
    planted_bypass_that_forgets_to_count: "include/migrate.glsl",
        "if (stays) counted.bypasses += 1u;" => "if (stays) counted.bypasses += 0u;", Conservation;
    planted_wrong_owner: "include/migrate.glsl",
        "owner == share.sm" => "owner == (share.sm ^ 1u)", Counters;
    planted_wrong_subtree: "include/migration.glsl",
        "return link & ~SUBTREE_LINK;" => "return link & ~SUBTREE_LINK & ~1u;", Hits;
    planted_digit_of_too_few_values: "include/queue.glsl",
        "(push.digits - 1u)" => "(push.digits / 2u - 1u)", Counters;
}

/// Whether hits of lanes that take one ray after the other differ from the twin's; nothing without a software driver.
fn check_strips(fault: Fault) -> Option<bool> {
    let (gpu, _folder) = gpu_with_fault(&["direct_cpu"], fault)?;
    if gpu.info().kind != DeviceKind::Cpu || gpu.probe().loop_limit.is_some() {
        eprintln!("SKIPPED: {} has other kernels", gpu.info().name);
        return None;
    }
    let (scene, options) = (caribou::scene::procedural::build("room", 4_000, 1).unwrap(), TracerOptions::default());
    let (bvh, rays) = (common::bvh(&scene), common::rays_around(&scene, 2_000));
    let (twin, _) = caribou::twin::trace::trace_closest(&bvh, &rays);
    Some(common::trace_as(&gpu, &bvh, (&rays, false), Query::Closest, &options).0 != twin)
}

#[test]
fn planted_faults_in_strips() {
    let (strips, loops) = ("include/direct.glsl", "include/trace.glsl");
    let faults = [
        ("a ray that is taken twice", strips, "push.strip + taken :", "push.strip + (taken & ~1u) :"),
        (
            "a strip that begins early",
            strips,
            "gl_WorkGroupID.x * push.strip +",
            "gl_WorkGroupID.x * (push.strip - 1u) +",
        ),
        (
            "a hit that another ray keeps",
            loops,
            "            hits[i] = finished(hit);",
            "            hits[i ^ 1u] = finished(hit);",
        ),
        ("a lane that forgets its hit", loops, "if (!COHERENT) break;", "if (!COHERENT) { hit.prim = NO_HIT; break; }"),
    ];
    let no_fault = Fault { file: strips, original: "push.strip + taken :", planted: "push.strip + taken : " };
    assert!(check_strips(no_fault).is_none_or(|differ| !differ));
    for (what, file, original, planted) in faults {
        assert!(check_strips(Fault { file, original, planted }).is_none_or(|differ| differ), "{what}");
    }
}

#[test]
fn planted_faults_in_the_virtual_l1() {
    let (cache, warp) = ("include/virtual_cache.glsl", "virtual_l1.comp");
    let faults = [
        ("first in, first out", cache, "if (hit || kind == ACCESS_LOAD", "if (!hit && kind == ACCESS_LOAD"),
        ("pushes that allocate", cache, "if (hit ||", "if (kind != ACCESS_STORE ||"),
        (
            "no coalescing",
            cache,
            "if (wanted == next) wanted = 0u;",
            "if (wanted == next && (turn & 1u) == 1u) wanted = 0u;",
        ),
        ("early reconvergence", warp, "any_leaf != 0u;\n    if", "any_leaf != 0u && any_node == 0u;\n    if"),
        ("stacks without depth", warp, "stack_at(turn, depth) / 32u", "turn.thread / 32u"),
    ];
    let no_fault = Fault { file: cache, original: "uint place = found;", planted: "uint place = found; " };
    assert!(check_virtual_l1(no_fault).is_none_or(|differ| differ == 0));
    for (what, file, original, planted) in faults {
        assert!(check_virtual_l1(Fault { file, original, planted }).is_none_or(|differ| differ > 0), "{what}");
    }
}
