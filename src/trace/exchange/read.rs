//! Reads and checks exchanged files.

use std::path::Path;

use super::{EdgeTriangle, Tree, leaf};
use crate::layout::{Hit, Ray};
use crate::shared::{LEAF_BIT, LEAF_COUNT_MASK, LEAF_FIRST_MASK, NO_HIT, STACK_SIZE, STEP_PUSHED};
use crate::{Error, Result};

/// First word of a `.bvh`.
const MAGIC: u32 = 0x3148_5642;
const HEADER: usize = 16;
const NODE: usize = 64;
const TRIANGLE: usize = 48;
const RAY: usize = 32;
const HIT: usize = 16;
/// Bits of a leaf's triangle count.
const COUNT_BITS: u32 = 4;

/// Reads a `.bvh`.
///
/// # Errors
/// [`Error::Io`] or [`Error::Input`]: header, sizes, links that lead nowhere, twice to one node or too deep.
pub fn read_tree(path: &Path) -> Result<Tree> {
    let bytes = read(path)?;
    let bad = |object: String, problem: String| {
        Error::input(path, object, problem, "write the file again, or take the one that belongs to the rays")
    };
    if bytes.len() < HEADER {
        return Err(bad("header".into(), format!("{} bytes where {HEADER} are the least", bytes.len())));
    }
    let [magic, nodes, triangles, zero] = [0, 1, 2, 3].map(|i| word(&bytes, i));
    if (magic, zero) != (MAGIC, 0) {
        return Err(bad("header".into(), format!("starts with {magic:#010x}, not {MAGIC:#010x}")));
    }
    if nodes == 0 || nodes >= STEP_PUSHED || triangles > LEAF_FIRST_MASK {
        return Err(bad("header".into(), format!("{nodes} nodes and {triangles} triangles")));
    }
    let (nodes, triangles) = (nodes as usize, triangles as usize);
    let size = HEADER + nodes * NODE + triangles * TRIANGLE;
    if bytes.len() != size {
        let problem = format!("{} bytes where {nodes} nodes and {triangles} triangles take {size}", bytes.len());
        return Err(bad("file".into(), problem));
    }
    let (node_bytes, triangle_bytes) = bytes[HEADER..].split_at(nodes * NODE);
    let mut tree = Tree { planes: Vec::new(), children: Vec::new(), triangles: Vec::new() };
    for (i, node) in node_bytes.chunks_exact(NODE).enumerate() {
        tree.planes.push(std::array::from_fn(|k| float(node, k)));
        let mut links = [0; 2];
        for (k, link) in links.iter_mut().enumerate() {
            *link = child(word(node, 12 + k), (nodes, triangles))
                .map_err(|problem| bad(format!("node {i}"), format!("child {k}: {problem}")))?;
        }
        tree.children.push(links);
    }
    let vector = |t: &[u8], at: usize| std::array::from_fn(|k| float(t, at + k));
    tree.triangles.extend(triangle_bytes.chunks_exact(TRIANGLE).map(|t| EdgeTriangle {
        corner: vector(t, 0),
        edges: [vector(t, 4), vector(t, 8)],
        prim: word(t, 3),
    }));
    check_links(&tree).map_err(|(node, problem)| bad(format!("node {node}"), problem))?;
    Ok(tree)
}

/// A child as a link of ours.
fn child(code: u32, (nodes, triangles): (usize, usize)) -> Result<u32, String> {
    if code & LEAF_BIT == 0 {
        return match (code as usize) < nodes {
            true => Ok(code),
            false => Err(format!("node {code} of {nodes}")),
        };
    }
    let (first, count) = (!code >> COUNT_BITS, !code & LEAF_COUNT_MASK);
    if first as usize + count as usize > triangles {
        return Err(format!("leaf of {count} triangles from {first} on, of {triangles}"));
    }
    Ok(leaf(first, count))
}

/// Every node is reached once from the root, over a path that the traversal stack can hold.
fn check_links(tree: &Tree) -> Result<(), (usize, String)> {
    let mut reached = vec![false; tree.children.len()];
    reached[0] = true;
    let mut pending = vec![(0, 1)];
    while let Some((node, depth)) = pending.pop() {
        if depth > STACK_SIZE {
            return Err((node, format!("{depth} levels below the root, where {STACK_SIZE} are the most")));
        }
        for link in tree.children[node] {
            if link & LEAF_BIT != 0 {
                continue;
            }
            if std::mem::replace(&mut reached[link as usize], true) {
                return Err((node, format!("node {link} is reached a second time")));
            }
            pending.push((link as usize, depth + 1));
        }
    }
    match reached.iter().position(|&reached| !reached) {
        Some(node) => Err((node, "is never reached".to_owned())),
        None => Ok(()),
    }
}

/// Reads `.rays`.
///
/// # Errors
/// [`Error::Io`] or [`Error::Input`]: no rays, or no whole number of them.
pub fn read_rays(path: &Path) -> Result<Vec<Ray>> {
    let bytes = records(path, RAY, "ray")?;
    Ok(bytes
        .chunks_exact(RAY)
        .map(|r| Ray {
            origin: [0, 1, 2].map(|k| float(r, k)),
            t_min: float(r, 3),
            direction: [4, 5, 6].map(|k| float(r, k)),
            t_max: float(r, 7),
        })
        .collect())
}

/// Reads `.hits` of a tree of `triangles` triangles.
///
/// # Errors
/// [`Error::Io`] or [`Error::Input`]: no hits, no whole number of them, or a primitive that the tree has not.
pub fn read_hits(path: &Path, triangles: usize) -> Result<Vec<Hit>> {
    let bytes = records(path, HIT, "hit")?;
    let hits: Vec<Hit> = bytes
        .chunks_exact(HIT)
        .map(|h| Hit { t: float(h, 0), prim: word(h, 1), u: float(h, 2), v: float(h, 3) })
        .collect();
    match hits.iter().position(|hit| hit.prim != NO_HIT && hit.prim as usize >= triangles) {
        Some(i) => {
            let problem = format!("primitive {} of {triangles}", hits[i].prim);
            Err(Error::input(path, format!("hit {i}"), problem, "take the hits that belong to the tree"))
        }
        None => Ok(hits),
    }
}

fn records(path: &Path, size: usize, what: &str) -> Result<Vec<u8>> {
    let bytes = read(path)?;
    if bytes.is_empty() || !bytes.len().is_multiple_of(size) {
        let problem = format!("{} bytes are no whole number of {what}s of {size}", bytes.len());
        return Err(Error::input(path, "file", problem, "write the file again"));
    }
    Ok(bytes)
}

fn read(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).map_err(Error::io("read", path))
}

fn word(bytes: &[u8], index: usize) -> u32 {
    let at = 4 * index;
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

fn float(bytes: &[u8], index: usize) -> f32 {
    f32::from_bits(word(bytes, index))
}
