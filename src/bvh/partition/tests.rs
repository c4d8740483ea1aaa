//! What holds for the partition of any tree.

use glam::Vec3;

use super::{MAX_SMS, Owners, Partition, PartitionStatistics, Policy};
use crate::bvh::{Bvh, Quality};
use crate::scene::procedural;
use crate::shared::{LEAF_BIT, SUBTREE_LINK};

const POLICIES: [&str; 12] = [
    "level:0",
    "level:1",
    "level:4",
    "level:12",
    "level:63",
    "bytes:384",
    "bytes:4KiB",
    "bytes:64KiB",
    "bytes:1GiB",
    "sah:384",
    "sah:4KiB",
    "sah:64KiB",
];

fn cut(bvh: &Bvh, policy: &str, sms: u32) -> Partition {
    Partition::new(bvh, policy.parse().unwrap(), Owners::default(), sms).unwrap()
}

fn triangles(count: usize) -> Bvh {
    let corner = |i: usize| Vec3::new(i as f32, (i * i % 7) as f32, 0.0);
    let positions: Vec<_> = (0..count).map(|i| [corner(i), corner(i) + Vec3::X, corner(i) + Vec3::Y]).collect();
    Bvh::build(&positions, Quality::default()).unwrap()
}

#[test]
fn every_policy_makes_valid_partitions() {
    let procedural = ["room", "forest", "blob", "needles"]
        .map(|name| Bvh::build(&procedural::build(name, 6_000, 1).unwrap().positions, Quality::default()).unwrap());
    let small = [0, 1, 2, 8, 9, 40].map(triangles);
    for (i, bvh) in procedural.iter().chain(&small).enumerate() {
        for policy in POLICIES {
            for owners in [Owners::Adjacent, Owners::Scattered] {
                for sms in [1, 2, 15, MAX_SMS] {
                    let partition = Partition::new(bvh, policy.parse().unwrap(), owners, sms).unwrap();
                    assert_eq!(partition.validate(bvh), Ok(()), "tree {i}, {policy}, {owners:?}, {sms} SMs");
                    assert_eq!(partition.sms(), sms);
                }
            }
        }
    }
}

#[test]
fn one_subtree_needs_no_top_tree() {
    let bvh = triangles(40);
    for policy in ["level:0", "bytes:1GiB"] {
        let partition = cut(&bvh, policy, 4);
        assert_eq!((partition.top.len(), partition.root, partition.subtrees.len()), (0, SUBTREE_LINK, 1), "{policy}");
    }
}

#[test]
fn a_tree_shallower_than_the_cut_has_its_leaves_as_subtrees() {
    let bvh = triangles(40);
    let partition = cut(&bvh, "level:63", 4);
    assert_eq!(partition.top.len(), bvh.nodes.len());
    assert!(partition.subtrees.iter().all(|subtree| subtree.root & LEAF_BIT != 0));
}

#[test]
fn sah_cuts_are_expected_to_move_fewer_bytes() {
    let bvh = Bvh::build(&procedural::build("forest", 50_000, 1).unwrap().positions, Quality::default()).unwrap();
    let bytes_moved = |policy: &str| {
        let statistics = PartitionStatistics::of(&cut(&bvh, policy, 15));
        64.0 * statistics.expected_top_visits + 128.0 * statistics.expected_subtree_visits
    };
    for size in ["4KiB", "64KiB", "512KiB"] {
        let (sah, bytes) = (bytes_moved(&format!("sah:{size}")), bytes_moved(&format!("bytes:{size}")));
        assert!(sah <= bytes, "{size}: {sah} against {bytes}");
    }
}

#[test]
fn numbers_of_sms_out_of_range_are_refused() {
    for sms in [0, MAX_SMS + 1, 10_000] {
        let error = Partition::new(&triangles(9), Policy::default(), Owners::default(), sms).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains("from 1 to 1024"), "{error}");
    }
}

/// Each fault that `validate` is there for is found by it.
#[test]
fn validation_finds_planted_faults() {
    let bvh = Bvh::build(&procedural::build("blob", 6_000, 1).unwrap().positions, Quality::default()).unwrap();
    let good = cut(&bvh, "bytes:4KiB", 15);
    type Fault = fn(&mut Partition);
    let faults: [(&str, Fault); 7] = [
        ("a subtree linked twice", |p| {
            let last = SUBTREE_LINK | (p.subtrees.len() as u32 - 1);
            let node = p.top.iter_mut().find(|node| node.child[0] & LEAF_BIT != 0).unwrap();
            node.child[0] = if node.child[0] == last { SUBTREE_LINK } else { last };
        }),
        ("a wrong owner", |p| p.subtrees[0].owner = 14),
        ("a wrong range of an SM", |p| p.first_of_sm[3] += 1),
        ("a wrong parent", |p| p.subtrees[5].parent += 1),
        ("a wrong root", |p| p.subtrees[5].root = p.subtrees[6].root),
        ("a footprint too large", |p| p.policy = Policy::Bytes(2_000)),
        ("a top box too small", |p| p.top[1].x[0] = p.top[1].x[0].next_up()),
    ];
    for (name, plant) in faults {
        let mut partition = good.clone();
        plant(&mut partition);
        assert!(partition.validate(&bvh).is_err(), "{name}");
    }
}
