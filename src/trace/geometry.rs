//! The BVH on the device.

use super::options::NodeFormat;
use crate::Result;
use crate::bvh::{Bvh, QuantisedBvh};
use crate::vulkan::{Buffer, Gpu};

/// Nodes and triangles in device memory; see `geometry.glsl` for how kernels reach them.
pub struct Geometry {
    /// Nodes from the root at 0.
    pub nodes: Buffer,
    /// Triangles in traversal order.
    pub triangles: Buffer,
    /// Low and high corner of the scene.
    pub bounds: [[f32; 3]; 2],
}

impl Geometry {
    /// Uploads `bvh` with its nodes in a format.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if it does not fit the device.
    pub fn upload(gpu: &Gpu, bvh: &Bvh, nodes: NodeFormat) -> Result<Geometry> {
        let nodes = match nodes {
            NodeFormat::Full => gpu.upload("nodes", &bvh.nodes),
            NodeFormat::Quantised => gpu.upload("quantised nodes", &QuantisedBvh::new(bvh).nodes),
        };
        Ok(Geometry {
            nodes: nodes?,
            triangles: gpu.upload("triangles", &bvh.triangles)?,
            bounds: [bvh.bounds.0.into(), bvh.bounds.1.into()],
        })
    }
}

/// A buffer's address as kernels take it: low word first.
pub fn address(buffer: &Buffer) -> [u32; 2] {
    let address = buffer.address();
    [address as u32, (address >> 32) as u32]
}
