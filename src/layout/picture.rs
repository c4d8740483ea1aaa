//! A picture on its way: camera and settings, paths, AOVs.

shared! {
    /// Everything that stays the same over a picture. Addresses are zero on the CPU.
    struct Frame {
        /// Eye, or middle of the picture plane of an orthographic camera.
        camera_origin: [f32; 3],
        /// Pixels across.
        width: u32,
        /// From the middle of the picture to its right edge, at distance 1.
        camera_right: [f32; 3],
        /// Pixels down.
        height: u32,
        /// From the middle of the picture to its top edge, at distance 1.
        camera_up: [f32; 3],
        /// 1 for an orthographic camera.
        orthographic: u32,
        /// Unit view direction.
        camera_forward: [f32; 3],
        /// Seed of all random numbers.
        seed: u32,
        /// Radiance of the sky straight up.
        sky_zenith: [f32; 3],
        /// Length of ambient occlusion rays.
        ao_radius: f32,
        /// Radiance of the sky at the horizon and below.
        sky_horizon: [f32; 3],
        /// Most bounces of a path.
        max_depth: u32,
        /// Radiance that an unoccluded ambient ray brings.
        ambient: [f32; 3],
        /// 1 if the sky does not show and alpha is coverage.
        transparent: u32,
        /// 1 if the scene has punctual lights.
        lit: u32,
        /// Zero.
        pad0: u32,
        /// Address of the triangles.
        triangles: [u32; 2],
        /// Address of the place of each primitive in the triangles.
        slots: [u32; 2],
        /// Address of the material of each primitive.
        material_ids: [u32; 2],
        /// Address of the packed corner normals.
        normals: [u32; 2],
        /// Address of the corner texture coordinates.
        uvs: [u32; 2],
        /// Address of the texels.
        texels: [u32; 2],
        /// Address of the 256 linear values of 8-bit sRGB.
        srgb: [u32; 2],
    }

    /// A path in flight: one sample of one pixel.
    struct Path {
        /// Share of the light at the path's end that reaches the camera.
        throughput: [f32; 3],
        /// Raster index of the pixel.
        pixel: u32,
        /// Light gathered so far.
        radiance: [f32; 3],
        /// Bounces and flags, `PATH_*` in [`crate::shared`].
        state: u32,
    }

    /// What a shadow ray brings if it arrives.
    struct Contribution {
        /// Light for the path's radiance.
        radiance: [f32; 3],
        /// Zero.
        pad: u32,
    }

    /// First hit of a pixel's first sample.
    struct AovPixel {
        /// Unit shading normal on the camera's side; zero for a miss.
        normal: [f32; 3],
        /// Distance along the view direction; [`crate::shared::Z_NOTHING`] for a miss.
        z: f32,
        /// Base colour, texture included.
        albedo: [f32; 3],
        /// Primitive id or [`crate::shared::NO_HIT`].
        prim: u32,
        /// World position.
        position: [f32; 3],
        /// Nodes visited by the camera ray.
        steps: f32,
        /// Times that it went to another SM.
        migrations: f32,
        /// Subtrees that it entered.
        subtrees: f32,
        /// Zero.
        pad0: u32,
        /// Zero.
        pad1: u32,
    }

    /// Push constants of the kernels of a picture's stages.
    struct StagePush {
        /// Index of the batch's first path among those of the chosen tiles.
        first: u32,
        /// Paths in the batch.
        count: u32,
        /// Sample number.
        sample_index: u32,
        /// The stage's own: light, ray kind, or samples of this pass so far.
        argument: u32,
    }
}
