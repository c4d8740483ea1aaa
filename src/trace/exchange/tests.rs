use std::path::PathBuf;

use super::*;
use crate::bvh::partition::Hierarchy;
use crate::bvh::{Bvh, Owners, Partition, Policy, Quality};
use crate::layout::{Ray, Triangle};
use crate::scene::procedural;
use crate::shared::{LEAF_FIRST_MASK, NO_HIT, STEP_PUSHED};

/// Two unit squares at z = 1 and z = 2 under one node, as bytes of a `.bvh`.
fn words() -> Vec<u32> {
    let f = f32::to_bits;
    let mut words = vec![0x3148_5642, 1, 2, 0];
    words.extend([0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0].map(f));
    words.extend([!(1u32), !(1 << 4 | 1), 0, 0]);
    for (prim, z) in [(1, 1.0), (0, 2.0)] {
        words.extend([f(0.0), f(0.0), f(z), prim, f(1.0), f(0.0), f(0.0), 0, f(0.0), f(1.0), f(0.0), 0]);
    }
    words
}

fn file(folder: &tempfile::TempDir, name: &str, words: &[u32]) -> PathBuf {
    let path = folder.path().join(name);
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    std::fs::write(&path, bytes).unwrap();
    path
}

fn ray(x: f32, z: f32, direction: f32) -> Ray {
    Ray { origin: [x, 0.2, z], t_min: 0.0, direction: [0.0, 0.0, direction], t_max: 1e30 }
}

#[test]
fn a_tree_is_read_and_walked_nearest_child_first() {
    let folder = tempfile::tempdir().unwrap();
    let tree = read_tree(&file(&folder, "a.bvh", &words())).unwrap();
    assert_eq!(tree.children, [[leaf(0, 1), leaf(1, 1)]]);
    assert_eq!(tree.triangles[1].prim, 0);
    let rays = [ray(0.2, 0.0, 1.0), ray(0.2, 3.0, -1.0), ray(5.0, 0.0, 1.0)];
    let (hits, trace) = record_reference(&tree, &rays);
    assert_eq!(trace.of(0), [STEP_PUSHED, leaf(0, 1), leaf(1, 1)]);
    assert_eq!(trace.of(1), [STEP_PUSHED, leaf(1, 1), leaf(0, 1)]);
    assert_eq!(trace.of(2), [0]);
    let found: Vec<(u32, f32)> = hits.iter().map(|hit| (hit.prim, hit.t)).collect();
    assert_eq!(found, [(1, 1.0), (0, 1.0), (NO_HIT, 1e30)]);
}

#[test]
fn what_a_tree_must_not_have_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |name: &str, words: &[u32], says: &str| {
        let error = read_tree(&file(&folder, name, words)).expect_err(name);
        assert_eq!(error.exit_code(), 2);
        let text = error.to_string();
        assert!(text.contains(name) && text.contains(says), "{text}");
    };
    let with = |at: usize, word: u32| {
        let mut words = words();
        words[at] = word;
        words
    };
    refused("short", &words()[..3], "12 bytes");
    refused("magic", &with(0, 7), "0x00000007");
    refused("nodes", &with(1, 0), "0 nodes");
    refused("many", &with(1, u32::MAX), "4294967295 nodes");
    refused("size", &with(2, 3), "3 triangles take");
    refused("link", &with(16, 1), "node 0: child 0: node 1 of 1");
    refused("cycle", &with(17, 0), "node 0 is reached a second time");
    refused("leaf", &with(16, !(1 << 4 | 2)), "leaf of 2 triangles from 1 on, of 2");
    let mut unreached = words();
    unreached[1] = 2;
    let node = unreached[4..20].to_vec();
    unreached.splice(20..20, node);
    refused("unreached", &unreached, "node 1: is never reached");
}

#[test]
fn a_tree_deeper_than_the_stack_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let chain = |nodes: u32| {
        let mut words = vec![0x3148_5642, nodes, 1, 0];
        for i in 1..=nodes {
            words.extend([0; 12]);
            words.extend([!1u32, if i < nodes { i } else { !0 }, 0, 0]);
        }
        words.extend([0; 12]);
        words
    };
    assert!(read_tree(&file(&folder, "64.bvh", &chain(64))).is_ok());
    let error = read_tree(&file(&folder, "65.bvh", &chain(65))).expect_err("too deep");
    assert!(error.to_string().contains("node 64: 65 levels"), "{error}");
}

#[test]
fn rays_and_hits_are_whole_and_in_range() {
    let folder = tempfile::tempdir().unwrap();
    let rays = read_rays(&file(&folder, "a.rays", &[1, 2, 3, 4, 5, 6, 7, 8].map(|k| f32::to_bits(k as f32)))).unwrap();
    assert_eq!(rays, [Ray { origin: [1.0, 2.0, 3.0], t_min: 4.0, direction: [5.0, 6.0, 7.0], t_max: 8.0 }]);
    assert!(read_rays(&file(&folder, "b.rays", &[0; 7])).is_err());
    assert!(read_rays(&file(&folder, "c.rays", &[])).is_err());
    let hits = file(&folder, "a.hits", &[0, NO_HIT, 0, 0, 0, 4, 0, 0]);
    assert_eq!(read_hits(&hits, 5).unwrap().len(), 2);
    let error = read_hits(&hits, 4).expect_err("out of range");
    assert!(error.to_string().contains("hit 1: primitive 4 of 4"), "{error}");
    assert!(matches!(read_hits(&folder.path().join("none"), 4), Err(crate::Error::Io { .. })));
}

/// A scene's tree as another program would have written it, with its nodes in another order: `places[i]` is where node
/// `i` went.
fn exchanged(bvh: &Bvh, places: &[u32]) -> Tree {
    let n = bvh.nodes.len();
    let mut tree = Tree { planes: vec![[0.0; 12]; n], children: vec![[0; 2]; n], triangles: Vec::new() };
    for (node, &place) in bvh.nodes.iter().zip(places) {
        let ([x0, x1, x2, x3], [y0, y1, y2, y3], [z0, z1, z2, z3]) = (node.x, node.y, node.z);
        tree.planes[place as usize] = [x0, x1, y0, y1, x2, x3, y2, y3, z0, z1, z2, z3];
        let moved = |link: u32| if link & LEAF_BIT == 0 { places[link as usize] } else { link };
        tree.children[place as usize] = node.child.map(moved);
    }
    let triangle = |t: &Triangle| EdgeTriangle { corner: t.v0, edges: [t.v1, t.v2], prim: t.prim };
    tree.triangles = bvh.triangles.iter().map(triangle).collect();
    tree
}

#[test]
fn an_exchanged_tree_is_cut_as_the_scene_s_whatever_the_order_of_its_nodes() {
    let bvh = Bvh::build(&procedural::build("room", 4_000, 1).unwrap().positions, Quality::default()).unwrap();
    let n = bvh.nodes.len() as u32;
    let same: Vec<u32> = (0..n).collect();
    let (nodes, bounds) = exchanged(&bvh, &same).nodes();
    assert_eq!((nodes, bounds), (bvh.nodes.clone(), bvh.bounds));
    // The root stays, the last node comes first.
    let turned: Vec<u32> = (0..n).map(|i| (n - i) % n).collect();
    let tree = exchanged(&bvh, &turned);
    assert_eq!(tree.check_leaves(), Ok(()));
    let (nodes, bounds) = tree.nodes();
    for policy in ["level:8", "bytes:8KiB", "sah:8KiB"] {
        let policy: Policy = policy.parse().unwrap();
        let expected = Partition::new(&bvh, policy, Owners::Adjacent, 15).unwrap();
        let found = Partition::of(Hierarchy { nodes: &nodes, bounds }, policy, Owners::Adjacent, 15).unwrap();
        let root = |link: u32| if link & LEAF_BIT == 0 { turned[link as usize] } else { link };
        assert!(expected.subtrees.len() > 15);
        let roots = |partition: &Partition, root: &dyn Fn(u32) -> u32| -> Vec<(u32, u32)> {
            partition.subtrees.iter().map(|subtree| (root(subtree.root), subtree.owner)).collect()
        };
        assert_eq!(roots(&expected, &root), roots(&found, &|link| link));
        assert_eq!(found.top_places, expected.top_places.iter().map(|&node| turned[node as usize]).collect::<Vec<_>>());
    }
}

#[test]
fn leaves_that_subtrees_cannot_be_cut_at_are_named() {
    let bvh = Bvh::build(&procedural::build("room", 4_000, 1).unwrap().positions, Quality::default()).unwrap();
    let places: Vec<u32> = (0..bvh.nodes.len() as u32).collect();
    let tree = exchanged(&bvh, &places);
    let deep =
        (0..tree.children.len()).rev().find(|&i| tree.children[i].iter().all(|link| link & LEAF_BIT != 0)).unwrap();
    let with = |link: u32| {
        let mut tree = tree.clone();
        tree.children[deep][0] = link;
        tree.check_leaves().unwrap_err()
    };
    assert_eq!(with(leaf(0, 0)), (deep, "has an empty leaf".to_owned()));
    assert_eq!(
        with(tree.children[deep][1]),
        (deep, format!("triangle {} is in a second leaf", tree.children[deep][1] & LEAF_FIRST_MASK))
    );
}
