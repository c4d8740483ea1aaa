//! The list of mesh primitives to flatten, with their counts checked before anything is allocated.

use glam::DAffine3;
use std::collections::BTreeSet;

use gltf::json::accessor::Accessor;
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};

use super::accessor::Accessors;
use super::nodes::Placed;
use super::remarks::Remarks;
use super::source::Source;
use super::topology::Topology;
use crate::Result;
use crate::shared::LEAF_FIRST_MASK;

/// A leaf's link holds the index of its first triangle in these bits.
const MAX_TRIANGLES: u64 = LEAF_FIRST_MASK as u64 + 1;
/// Vertices cost time for each instance, used or not.
const MAX_VERTICES: u64 = 3 * MAX_TRIANGLES;
/// An instance costs time even if it has no triangle.
const MAX_INSTANCES: usize = 1 << 22;

/// A mesh primitive that has triangles.
pub(super) struct Shape<'a> {
    /// Indices of the mesh and of the primitive in it.
    object: (usize, usize),
    pub primitive: &'a Primitive,
    pub topology: Topology,
    pub positions: Index<Accessor>,
    pub vertices: usize,
    pub triangles: usize,
}

impl Shape<'_> {
    /// The accessor of an attribute.
    pub fn attribute(&self, semantic: Semantic) -> Option<Index<Accessor>> {
        self.primitive.attributes.get(&Checked::Valid(semantic)).copied()
    }

    /// The primitive's name in messages.
    pub fn name(&self) -> String {
        format!("mesh {}: primitive {}", self.object.0, self.object.1)
    }
}

/// A shape at a place in the world.
pub(super) struct Instance<'a> {
    pub shape: &'a Shape<'a>,
    pub node: usize,
    pub world: &'a DAffine3,
}

/// The shapes of each mesh that a placed node holds; remarks on what of them is left out.
pub(super) fn shapes<'a>(
    source: &Source,
    root: &'a Root,
    accessors: &Accessors,
    placed: &[Placed],
    remarks: &mut Remarks,
) -> Result<Vec<Vec<Shape<'a>>>> {
    let mut shapes: Vec<Vec<Shape>> = (0..root.meshes.len()).map(|_| Vec::new()).collect();
    let held: BTreeSet<usize> = placed.iter().filter_map(|p| Some(root.nodes[p.node].mesh?.value())).collect();
    for mesh in held {
        for (p, primitive) in root.meshes[mesh].primitives.iter().enumerate() {
            shapes[mesh].extend(shape(source, accessors, primitive, (mesh, p), remarks)?);
        }
    }
    Ok(shapes)
}

/// Places the shapes of all nodes; an error if that is more than can be rendered.
pub(super) fn list<'a>(
    source: &Source,
    root: &Root,
    shapes: &'a [Vec<Shape<'a>>],
    placed: &'a [Placed],
) -> Result<Vec<Instance<'a>>> {
    let mut instances = Vec::new();
    let (mut triangles, mut vertices) = (0, 0);
    for place in placed {
        let Some(mesh) = root.nodes[place.node].mesh else { continue };
        for shape in &shapes[mesh.value()] {
            triangles += shape.triangles as u64;
            vertices += shape.vertices as u64;
            instances.push(Instance { shape, node: place.node, world: &place.world });
            if triangles > MAX_TRIANGLES || vertices > MAX_VERTICES || instances.len() > MAX_INSTANCES {
                let problem = format!(
                    "with this instance the scene has {triangles} triangles, {vertices} vertices and {} mesh instances",
                    instances.len()
                );
                let remedy = format!(
                    "simplify the scene: at most {MAX_TRIANGLES}, {MAX_VERTICES} and {MAX_INSTANCES} are supported"
                );
                return Err(source.fault(format!("node {}", place.node), problem, remedy));
            }
        }
    }
    Ok(instances)
}

/// One primitive; `None` if it has no triangles to show.
fn shape<'a>(
    source: &Source,
    accessors: &Accessors,
    primitive: &'a Primitive,
    object: (usize, usize),
    remarks: &mut Remarks,
) -> Result<Option<Shape<'a>>> {
    let name = || format!("mesh {}: primitive {}", object.0, object.1);
    let Checked::Valid(mode) = primitive.mode else { return Ok(None) }; // cannot happen: see `references`
    let Some(topology) = Topology::of(mode) else {
        remarks.add("Points and lines are not supported and left out");
        return Ok(None);
    };
    let Some(&positions) = primitive.attributes.get(&Checked::Valid(Semantic::Positions)) else {
        // Legal (section 3.7.2.1), for extensions that supply the positions.
        remarks.add("A mesh primitive without POSITION is left out");
        return Ok(None);
    };
    let vertices = accessors.count(positions);
    for (semantic, &accessor) in &primitive.attributes {
        let count = accessors.count(accessor);
        if count != vertices {
            let problem = format!(
                "has {vertices} positions but accessor {} for {} has {count} elements",
                accessor.value(),
                semantic.to_string()
            );
            return Err(source.fault(name(), problem, "all attributes need the same count: export the scene again"));
        }
    }
    let corners = primitive.indices.map_or(vertices, |indices| accessors.count(indices));
    if topology == Topology::List && !corners.is_multiple_of(3) {
        remarks.add("A triangle list ends with an incomplete triangle, which is left out");
    }
    remark_unsupported(primitive, remarks);
    // A count fits usize: accessors lie inside buffers that are in memory, or are bounded.
    let (vertices, triangles) = (vertices as usize, topology.triangles(corners) as usize);
    Ok(Some(Shape { object, primitive, topology, positions, vertices, triangles }))
}

fn remark_unsupported(primitive: &Primitive, remarks: &mut Remarks) {
    if primitive.targets.as_ref().is_some_and(|targets| !targets.is_empty()) {
        remarks.add("Morph targets are not supported; the base shape is shown");
    }
    if primitive.attributes.keys().any(|key| matches!(key, Checked::Valid(Semantic::Colors(_)))) {
        remarks.add("Vertex colours are not supported and left out");
    }
}
