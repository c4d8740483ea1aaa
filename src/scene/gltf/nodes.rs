//! The node hierarchy: checked to be a forest, and walked without recursion to world transforms.

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};
use gltf::json::{Index, Node, Root};

use super::source::Source;
use crate::Result;

/// A node reached from the scene.
pub(super) struct Placed {
    /// Index of the node.
    pub node: usize,
    /// Its frame to the world's. Double precision, so that deep hierarchies lose nothing visible.
    pub world: DAffine3,
}

/// The nodes of the scene to show, parents before children, in file order.
pub(super) fn place(source: &Source, root: &Root) -> Result<Vec<Placed>> {
    check_forest(source, root)?;
    let roots = scene_nodes(source, root)?;
    let mut placed = Vec::new();
    let mut pending: Vec<(usize, DAffine3)> =
        roots.iter().rev().map(|node| (node.value(), DAffine3::IDENTITY)).collect();
    while let Some((node, parent)) = pending.pop() {
        let world = parent * local(source, root, node)?;
        if !world.is_finite() {
            return Err(fault_transform(source, node, "its world transform overflows"));
        }
        placed.push(Placed { node, world });
        let children = root.nodes[node].children.iter().flatten();
        pending.extend(children.rev().map(|child| (child.value(), world)));
    }
    Ok(placed)
}

/// The nodes of the default scene or, failing that, of scene 0.
fn scene_nodes<'a>(source: &Source, root: &'a Root) -> Result<&'a [Index<Node>]> {
    if root.scenes.is_empty() {
        return match root.nodes.len() {
            0 => Ok(&[]),
            n => Err(source.fault(
                "scenes",
                format!("the file has {n} nodes but no scene"),
                "it is a library of parts: export it with a scene",
            )),
        };
    }
    let index = root.scene.map_or(0, |scene| scene.value());
    Ok(&root.scenes[index].nodes)
}

/// Every node has at most one parent, there are no cycles, and scenes list only roots, each once
/// (glTF 2.0, section 3.5.2).
fn check_forest(source: &Source, root: &Root) -> Result<()> {
    let remedy = "nodes must form trees: export the scene again";
    let mut parents: Vec<Option<usize>> = vec![None; root.nodes.len()];
    for (i, node) in root.nodes.iter().enumerate() {
        for child in node.children.iter().flatten().map(|child| child.value()) {
            if let Some(other) = parents[child].replace(i) {
                return Err(source.fault(format!("node {child}"), format!("has two parents, {other} and {i}"), remedy));
            }
        }
    }
    // Walks up from each node; a walk that meets its own mark has gone round.
    let mut mark = vec![usize::MAX; parents.len()];
    for start in 0..parents.len() {
        let mut node = start;
        while mark[node] == usize::MAX {
            mark[node] = start;
            match parents[node] {
                Some(parent) if mark[parent] == start => {
                    return Err(source.fault(format!("node {parent}"), "is its own ancestor", remedy));
                }
                Some(parent) => node = parent,
                None => break,
            }
        }
    }
    for (i, scene) in root.scenes.iter().enumerate() {
        let mut listed = vec![false; parents.len()];
        for node in scene.nodes.iter().map(|node| node.value()) {
            if let Some(parent) = parents[node] {
                let problem = format!("lists node {node}, which is a child of node {parent}");
                return Err(source.fault(format!("scene {i}"), problem, remedy));
            }
            if std::mem::replace(&mut listed[node], true) {
                return Err(source.fault(format!("scene {i}"), format!("lists node {node} twice"), remedy));
            }
        }
    }
    Ok(())
}

/// A node's own transform: a matrix, or translation x rotation x scale (section 3.5.3).
fn local(source: &Source, root: &Root, index: usize) -> Result<DAffine3> {
    let node = &root.nodes[index];
    let transform = match node.matrix {
        Some(matrix) => {
            let matrix = DMat4::from_cols_array(&matrix.map(f64::from));
            let bottom = matrix.row(3).to_array();
            // Room for exporters that multiply matrices in single precision.
            if bottom.iter().zip([0.0, 0.0, 0.0, 1.0]).any(|(a, b)| (a - b).abs() > 1e-4) {
                return Err(fault_transform(source, index, "its matrix is not affine: the last row is not 0 0 0 1"));
            }
            DAffine3::from_mat4(matrix)
        }
        None => {
            let vector = |v: Option<[f32; 3]>, default| v.map_or(default, |v| DVec3::from(v.map(f64::from)));
            let rotation = node.rotation.map_or([0.0, 0.0, 0.0, 1.0], |r| r.0.map(f64::from));
            // Not all exporters write unit quaternions to the last bit.
            let rotation = DQuat::from_array(rotation);
            if !rotation.is_finite() || rotation.length() < 1e-6 {
                return Err(fault_transform(source, index, "its rotation is not a unit quaternion"));
            }
            DAffine3::from_scale_rotation_translation(
                vector(node.scale, DVec3::ONE),
                rotation.normalize(),
                vector(node.translation, DVec3::ZERO),
            )
        }
    };
    match transform.is_finite() {
        true => Ok(transform),
        false => Err(fault_transform(source, index, "its transform is not finite")),
    }
}

fn fault_transform(source: &Source, node: usize, problem: &str) -> crate::Error {
    source.fault(format!("node {node}"), problem, "correct the node's transform")
}

/// Right-handed orthonormal axes of a frame whose scale and mirroring are dropped; `None` if it is flat.
pub(super) fn orthonormal(frame: DMat3) -> Option<DMat3> {
    let z = frame.z_axis.try_normalize()?;
    let y = (frame.y_axis - z * z.dot(frame.y_axis)).try_normalize()?;
    Some(DMat3::from_cols(y.cross(z), y, z))
}
