//! Builds the BVH with obvhs and lays it out for traversal.

use glam::Vec3;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::{BvhBuildParams, triangle::Triangle as BuildTriangle};
use rayon::prelude::*;

use crate::layout::{Node, Triangle};
use crate::shared::{LEAF_BIT, LEAF_COUNT_SHIFT, LEAF_FIRST_MASK, MAX_LEAF_TRIANGLES, STACK_SIZE};
use crate::{Error, Result};

/// Largest coordinate that keeps every product of the triangle test below the largest float.
const COORDINATE_CEILING: f32 = 1.0e18;

/// A box that no ray meets before [`crate::shared::FAR_AWAY`]: stands for a missing child.
const NOWHERE: (Vec3, Vec3) = (Vec3::splat(f32::MAX), Vec3::splat(f32::MAX));

/// Node of an empty leaf.
const EMPTY_LEAF: u32 = LEAF_BIT;

/// How much time the builder spends on quality; obvhs's presets of the same names.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs, reason = "the names say it")]
pub enum Quality {
    Fastest,
    VeryFast,
    Fast,
    #[default]
    Medium,
    Slow,
    VerySlow,
}

impl Quality {
    fn parameters(self) -> BvhBuildParams {
        let preset = match self {
            Quality::Fastest => BvhBuildParams::fastest_build(),
            Quality::VeryFast => BvhBuildParams::very_fast_build(),
            Quality::Fast => BvhBuildParams::fast_build(),
            Quality::Medium => BvhBuildParams::medium_build(),
            Quality::Slow => BvhBuildParams::slow_build(),
            Quality::VerySlow => BvhBuildParams::very_slow_build(),
        };
        // Without spatial splits every triangle is in one leaf, which keeps primitive ids and leaves
        // one to one.
        BvhBuildParams {
            pre_split: false,
            max_prims_per_leaf: preset.max_prims_per_leaf.min(MAX_LEAF_TRIANGLES),
            ..preset
        }
    }
}

/// A BVH laid out for traversal: inner nodes in depth-first order from the root at 0, triangles in the
/// order in which the leaves are met.
#[derive(Clone, Debug)]
pub struct Bvh {
    /// At least one node.
    pub nodes: Vec<Node>,
    /// All triangles of the scene, each once; one zero triangle if the scene has none.
    pub triangles: Vec<Triangle>,
    /// Place of each primitive in `triangles`.
    pub slots: Vec<u32>,
    /// Low and high corner of the scene; zero if it is empty.
    pub bounds: (Vec3, Vec3),
    /// Triangles of the scene.
    pub triangle_count: usize,
}

impl Bvh {
    /// Builds over `positions`, whose index becomes the primitive id.
    ///
    /// # Errors
    /// [`Error::Usage`] if there are more than 134,217,728 triangles, a coordinate is beyond 1e18, or the
    /// tree comes out deeper than the traversal stack.
    pub fn build(positions: &[[Vec3; 3]], quality: Quality) -> Result<Bvh> {
        check_limits(positions)?;
        if positions.is_empty() {
            return Ok(Bvh::empty());
        }
        let triangles: Vec<BuildTriangle> =
            positions.par_iter().map(|&[a, b, c]| BuildTriangle { v0: a.into(), v1: b.into(), v2: c.into() }).collect();
        let tree = build_tree(&triangles, quality)?;
        drop(triangles);
        Ok(lay_out(&tree, positions))
    }

    fn empty() -> Bvh {
        Bvh {
            nodes: vec![node([(NOWHERE, EMPTY_LEAF), (NOWHERE, EMPTY_LEAF)])],
            triangles: vec![bytemuck::Zeroable::zeroed()],
            slots: vec![0],
            bounds: (Vec3::ZERO, Vec3::ZERO),
            triangle_count: 0,
        }
    }

    /// Bytes of nodes and triangles.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.triangles[..])
    }
}

fn check_limits(positions: &[[Vec3; 3]]) -> Result<()> {
    let most = LEAF_FIRST_MASK as usize;
    if positions.len() > most {
        return Err(Error::usage(
            format!("the scene has {} triangles", positions.len()),
            format!("the BVH holds up to {most}: split the scene"),
        ));
    }
    let within = |v: &Vec3| v.abs().max_element() <= COORDINATE_CEILING;
    match positions.par_iter().position_any(|corners| !corners.iter().all(within)) {
        None => Ok(()),
        Some(triangle) => Err(Error::usage(
            format!("triangle {triangle} has a coordinate beyond {COORDINATE_CEILING:e}: {:?}", positions[triangle]),
            "scale the scene down",
        )),
    }
}

/// Builds at the asked quality and, if reinsertion made the tree too deep for the stack, without it.
fn build_tree(triangles: &[BuildTriangle], quality: Quality) -> Result<Bvh2> {
    let build = |parameters| build_bvh2_from_tris(triangles, parameters, &mut std::time::Duration::default());
    let tree = build(quality.parameters());
    if tree.depth(0) <= STACK_SIZE as usize {
        return Ok(tree);
    }
    let tree = build(Quality::Fastest.parameters());
    match tree.depth(0) {
        depth if depth <= STACK_SIZE as usize => Ok(tree),
        depth => Err(Error::usage(
            format!("the BVH of this scene is {depth} levels deep, the traversal stack holds {STACK_SIZE}"),
            "merge coincident triangles",
        )),
    }
}

fn node(children: [((Vec3, Vec3), u32); 2]) -> Node {
    let [((low0, high0), link0), ((low1, high1), link1)] = children;
    let axis = |k: usize| [low0[k], high0[k], low1[k], high1[k]];
    Node { x: axis(0), y: axis(1), z: axis(2), child: [link0, link1], pad: [0; 2] }
}

/// Depth-first: a node, then all below its first child, then all below its second.
fn lay_out(tree: &Bvh2, positions: &[[Vec3; 3]]) -> Bvh {
    let mut layout = Layout {
        tree,
        positions,
        nodes: Vec::with_capacity(tree.nodes.len() / 2 + 1),
        triangles: Vec::with_capacity(positions.len()),
    };
    let root = &tree.nodes[0];
    let bounds = (root.aabb().min.into(), root.aabb().max.into());
    if root.is_leaf() {
        let leaf = layout.leaf(0);
        layout.nodes.push(node([(bounds, leaf), (NOWHERE, EMPTY_LEAF)]));
    } else {
        layout.inner_nodes();
    }
    let Layout { nodes, triangles, .. } = layout;
    let mut slots = vec![0; positions.len()];
    for (slot, triangle) in triangles.iter().enumerate() {
        slots[triangle.prim as usize] = slot as u32;
    }
    Bvh { nodes, triangles, slots, bounds, triangle_count: positions.len() }
}

struct Layout<'a> {
    tree: &'a Bvh2,
    positions: &'a [[Vec3; 3]],
    nodes: Vec<Node>,
    triangles: Vec<Triangle>,
}

impl Layout<'_> {
    /// Appends a leaf's triangles, lowest primitive id first, and returns its link.
    fn leaf(&mut self, index: usize) -> u32 {
        let leaf = &self.tree.nodes[index];
        let first = self.triangles.len();
        let range = leaf.first_index as usize..(leaf.first_index + leaf.prim_count) as usize;
        self.triangles.extend(self.tree.primitive_indices[range].iter().map(|&prim| {
            let [v0, v1, v2] = self.positions[prim as usize].map(Into::into);
            Triangle { v0, prim, v1, pad1: 0, v2, pad2: 0 }
        }));
        self.triangles[first..].sort_by_key(|triangle| triangle.prim);
        LEAF_BIT | leaf.prim_count << LEAF_COUNT_SHIFT | first as u32
    }

    /// Walks the inner nodes with a stack of (source node, where its link belongs).
    fn inner_nodes(&mut self) {
        let mut pending: Vec<(usize, Option<(usize, usize)>)> = vec![(0, None)];
        while let Some((source, parent)) = pending.pop() {
            let link = if self.tree.nodes[source].is_leaf() { self.leaf(source) } else { self.inner(source) };
            if let Some((node, side)) = parent {
                self.nodes[node].child[side] = link;
            }
            if link & LEAF_BIT == 0 {
                let first = self.tree.nodes[source].first_index as usize;
                pending.push((first + 1, Some((link as usize, 1))));
                pending.push((first, Some((link as usize, 0))));
            }
        }
    }

    /// Appends an inner node whose links are still to come.
    fn inner(&mut self, source: usize) -> u32 {
        let first = self.tree.nodes[source].first_index as usize;
        let bounds = |index: usize| {
            let aabb = self.tree.nodes[index].aabb();
            (Vec3::from(aabb.min), Vec3::from(aabb.max))
        };
        self.nodes.push(node([(bounds(first), 0), (bounds(first + 1), 0)]));
        self.nodes.len() as u32 - 1
    }
}
