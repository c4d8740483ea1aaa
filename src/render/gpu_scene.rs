//! Materials, textures, lights and attributes on the device.

use crate::Result;
use crate::bvh::Bvh;
use crate::layout::Frame;
use crate::scene::tables::Tables;
use crate::trace::Geometry;
use crate::trace::geometry::address;
use crate::vulkan::{Buffer, Gpu};

/// What the shading kernels read besides the geometry.
pub struct GpuScene {
    /// The frame, addresses filled in.
    pub frame: Buffer,
    /// Materials.
    pub materials: Buffer,
    /// Texture headers.
    pub textures: Buffer,
    /// Lights.
    pub lights: Buffer,
    /// Buffers that kernels reach by address.
    pub reached: Vec<Buffer>,
}

impl GpuScene {
    /// Uploads `tables`, and `frame` with the addresses.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if it does not fit.
    pub fn upload(gpu: &Gpu, bvh: &Bvh, geometry: &Geometry, tables: &Tables, frame: Frame) -> Result<GpuScene> {
        let slots = gpu.upload("slots", &bvh.slots)?;
        let material_ids = gpu.upload("material ids", &tables.material_ids)?;
        let normals = gpu.upload("normals", &tables.normals)?;
        let uvs = gpu.upload("texture coordinates", &tables.uvs)?;
        let texels = gpu.upload("texels", &tables.texels)?;
        let srgb = gpu.upload("sRGB table", &tables.srgb)?;
        let frame = Frame {
            triangles: geometry.triangles(),
            slots: address(&slots),
            material_ids: address(&material_ids),
            normals: address(&normals),
            uvs: address(&uvs),
            texels: address(&texels),
            srgb: address(&srgb),
            ..frame
        };
        Ok(GpuScene {
            frame: gpu.upload("frame", &[frame])?,
            materials: gpu.upload("materials", &tables.materials)?,
            textures: gpu.upload("textures", &tables.textures)?,
            lights: gpu.upload("lights", &tables.lights)?,
            reached: vec![slots, material_ids, normals, uvs, texels, srgb],
        })
    }
}
