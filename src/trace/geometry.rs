//! The BVH on the device.

use super::options::NodeFormat;
use crate::Result;
use crate::bvh::{Bvh, QuantisedBvh};
use crate::vulkan::{Buffer, Gpu, Place};
use bytemuck::cast_slice;

/// Nodes and triangles in device memory; see `geometry.glsl` for how kernels reach them.
pub struct Geometry {
    /// Nodes from the root at 0, then triangles in traversal order: one buffer, so that lanes of a software driver
    /// fetch both together.
    pub tree: Buffer,
    /// Bytes of the nodes.
    node_bytes: u64,
    /// Low and high corner of the scene.
    pub bounds: [[f32; 3]; 2],
}

impl Geometry {
    /// Uploads `bvh` with its nodes in a format.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if it does not fit the device.
    pub fn upload(gpu: &Gpu, bvh: &Bvh, nodes: NodeFormat) -> Result<Geometry> {
        let quantised;
        let nodes: &[u32] = match nodes {
            NodeFormat::Full => cast_slice(&bvh.nodes),
            NodeFormat::Quantised => {
                quantised = QuantisedBvh::new(bvh).nodes;
                cast_slice(&quantised)
            }
        };
        let triangles: &[u32] = cast_slice(&bvh.triangles);
        let tree = gpu.buffer("tree", (size_of_val(nodes) + size_of_val(triangles)) as u64, Place::Device)?;
        gpu.write(&tree, 0, nodes)?;
        gpu.write(&tree, nodes.len(), triangles)?;
        Ok(Geometry { tree, node_bytes: size_of_val(nodes) as u64, bounds: [bvh.bounds.0.into(), bvh.bounds.1.into()] })
    }

    /// Address of the root, as kernels take it.
    pub fn nodes(&self) -> [u32; 2] {
        words(self.tree.address())
    }

    /// Address of the first triangle, as kernels take it.
    pub fn triangles(&self) -> [u32; 2] {
        words(self.tree.address() + self.node_bytes)
    }
}

/// A buffer's address as kernels take it.
pub fn address(buffer: &Buffer) -> [u32; 2] {
    words(buffer.address())
}

/// An address, low word first.
fn words(address: u64) -> [u32; 2] {
    [address as u32, (address >> 32) as u32]
}
