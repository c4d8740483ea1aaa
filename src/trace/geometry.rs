//! The BVH on the device.

use super::options::NodeFormat;
use crate::Result;
use crate::bvh::{Bvh, Partition, QuantisedBvh};
use crate::layout::{Node, Subtree};
use crate::shared::LEAF_BIT;
use crate::vulkan::{Buffer, Gpu, Place};
use bytemuck::cast_slice;

/// Nodes and triangles in device memory; see `geometry.glsl` for how kernels reach them.
pub struct Geometry {
    /// Nodes from the root at 0, those of a partition's top tree, its subtrees, and triangles in traversal order: one
    /// buffer, so that lanes of a software driver fetch all together.
    pub tree: Buffer,
    /// Index of the first node of the top tree.
    pub first_top: u32,
    /// Byte offset of the subtrees.
    subtrees: u64,
    /// Byte offset of the triangles.
    triangles: u64,
    /// Low and high corner of the scene.
    pub bounds: [[f32; 3]; 2],
}

impl Geometry {
    /// Uploads `bvh` with its nodes in a format, and how it was cut, if it was.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if it does not fit the device.
    pub fn upload(gpu: &Gpu, bvh: &Bvh, nodes: NodeFormat, partition: Option<&Partition>) -> Result<Geometry> {
        let quantised;
        let nodes: &[u32] = match nodes {
            NodeFormat::Full => cast_slice(&bvh.nodes),
            NodeFormat::Quantised => {
                quantised = QuantisedBvh::new(bvh).nodes;
                cast_slice(&quantised)
            }
        };
        let first_top = bvh.nodes.len() as u32;
        let (top, subtrees) = partition.map_or((Vec::new(), Vec::new()), |partition| placed(partition, first_top));
        let parts: [&[u32]; 4] = [nodes, cast_slice(&top), cast_slice(&subtrees), cast_slice(&bvh.triangles)];
        let bytes: Vec<u64> = parts.iter().map(|part| size_of_val(*part) as u64).collect();
        let tree = gpu.buffer("tree", bytes.iter().sum(), Place::Device)?;
        let mut words = 0;
        for part in parts {
            gpu.write(&tree, words, part)?;
            words += part.len();
        }
        Ok(Geometry {
            tree,
            first_top,
            subtrees: bytes[..2].iter().sum(),
            triangles: bytes[..3].iter().sum(),
            bounds: [bvh.bounds.0.into(), bvh.bounds.1.into()],
        })
    }

    /// Where kernels find a link of the top tree.
    pub fn top_link(&self, link: u32) -> u32 {
        placed_link(link, self.first_top)
    }

    /// Address of the root, as kernels take it.
    pub fn nodes(&self) -> [u32; 2] {
        words(self.tree.address())
    }

    /// Address of the first subtree, as kernels take it.
    pub fn subtrees(&self) -> [u32; 2] {
        words(self.tree.address() + self.subtrees)
    }

    /// Address of the first triangle, as kernels take it.
    pub fn triangles(&self) -> [u32; 2] {
        words(self.tree.address() + self.triangles)
    }
}

/// The top tree and the subtrees of a partition with links as of [`placed_link`].
fn placed(partition: &Partition, first_top: u32) -> (Vec<Node>, Vec<Subtree>) {
    let place = |link| placed_link(link, first_top);
    let node = |node: &Node| Node { child: node.child.map(place), parent: place(node.parent), ..*node };
    let subtree = |subtree: &Subtree| Subtree { parent: place(subtree.parent), ..*subtree };
    (partition.top.iter().map(node).collect(), partition.subtrees.iter().map(subtree).collect())
}

/// A link of a partition's top tree, where its nodes are those from `first_top` on.
fn placed_link(link: u32, first_top: u32) -> u32 {
    if link & LEAF_BIT == 0 { first_top + link } else { link }
}

/// A buffer's address as kernels take it.
pub fn address(buffer: &Buffer) -> [u32; 2] {
    words(buffer.address())
}

/// An address, low word first.
fn words(address: u64) -> [u32; 2] {
    [address as u32, (address >> 32) as u32]
}
