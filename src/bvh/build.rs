//! Builds the BVH with obvhs.

use glam::Vec3;
use obvhs::BvhBuildParams;
use obvhs::bvh2::builder::build_bvh2;
use rayon::prelude::*;

use super::coincident::BuildPrimitives;
use super::lay_out::lay_out;
use super::partition::Hierarchy;
use super::pieces::Pieces;
use super::ties::untied;
use crate::layout::{Node, Triangle};
use crate::shared::{LEAF_BIT, LEAF_FIRST_MASK, MAX_LEAF_TRIANGLES};
use crate::{Error, Result};

/// Largest coordinate that keeps every product of the triangle test below the largest float.
const COORDINATE_CEILING: f32 = 1.0e18;

/// A box that no ray meets before [`crate::shared::FAR_AWAY`]: stands for a missing child.
pub(super) const NOWHERE: (Vec3, Vec3) = (Vec3::splat(f32::MAX), Vec3::splat(f32::MAX));

/// Link of an empty leaf.
pub(super) const EMPTY_LEAF: u32 = LEAF_BIT;

/// How much time the builder spends on quality; obvhs's presets of the same names. From [`Quality::Medium`] on,
/// large triangles are cut into pieces.
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
        // obvhs cuts from `Slow` on. It costs little, tests fewer triangles where there are large ones (a quarter
        // fewer in the Conference Room) and changes hardly anything elsewhere: docs/speed.md.
        let pre_split = preset.pre_split || self == Quality::Medium;
        let max_prims_per_leaf = preset.max_prims_per_leaf.min(MAX_LEAF_TRIANGLES);
        BvhBuildParams { pre_split, max_prims_per_leaf, ..preset }
    }
}

/// A BVH laid out for traversal: inner nodes in depth-first order from the root at 0, triangles in the
/// order in which the leaves are met.
#[derive(Clone, Debug)]
pub struct Bvh {
    /// At least one node.
    pub nodes: Vec<Node>,
    /// The triangles of all leaves: every triangle of the scene, those that were cut once for each leaf with a
    /// piece of them; one zero triangle if the scene has none.
    pub triangles: Vec<Triangle>,
    /// A place of each primitive in `triangles`.
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
    /// [`Error::Usage`] if there are more than 134,217,727 triangles or a coordinate is beyond 1e18.
    pub fn build(positions: &[[Vec3; 3]], quality: Quality) -> Result<Bvh> {
        check_limits(positions)?;
        if positions.is_empty() {
            return Ok(Bvh::empty());
        }
        let parameters = quality.parameters();
        let pieces = if parameters.pre_split { Pieces::cut(positions) } else { Pieces::whole(positions) };
        let primitives = BuildPrimitives::new(pieces);
        let tree = build_bvh2(&untied(&primitives.boxes()), parameters, &mut std::time::Duration::default());
        Ok(lay_out(&tree, &primitives, positions))
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

    /// The tree as it can be cut into subtrees.
    pub fn hierarchy(&self) -> Hierarchy<'_> {
        Hierarchy { nodes: &self.nodes, bounds: self.bounds }
    }

    /// Triangles of all leaves together.
    pub fn references(&self) -> usize {
        if self.triangle_count == 0 { 0 } else { self.triangles.len() }
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
    // Also false for NaN.
    let within = |v: &Vec3| v.abs().cmple(Vec3::splat(COORDINATE_CEILING)).all();
    match positions.par_iter().position_any(|corners| !corners.iter().all(within)) {
        None => Ok(()),
        Some(triangle) => Err(Error::usage(
            format!("triangle {triangle} has a coordinate beyond {COORDINATE_CEILING:e}: {:?}", positions[triangle]),
            "scale the scene down",
        )),
    }
}

/// A node from the boxes and links of its children.
pub(super) fn node(children: [((Vec3, Vec3), u32); 2]) -> Node {
    let [((low0, high0), link0), ((low1, high1), link1)] = children;
    let axis = |k: usize| [low0[k], high0[k], low1[k], high1[k]];
    Node { x: axis(0), y: axis(1), z: axis(2), child: [link0, link1], parent: 0, level: 0 }
}
