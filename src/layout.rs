//! Structs shared with the kernels, one for one with `glsl/include/types.glsl`. `tests/layout.rs` compares
//! names and offsets with the compiled SPIR-V.

use bytemuck::{Pod, Zeroable};

/// A struct with the kernels' layout.
pub trait Shared: Pod {
    /// Its name in GLSL.
    const NAME: &'static str;
    /// Name and byte offset of each field.
    const FIELDS: &'static [(&'static str, usize)];
}

macro_rules! shared {
    ($($(#[$about:meta])* struct $name:ident { $($(#[$field_about:meta])* $field:ident: $kind:ty,)* })*) => {
        $(
            $(#[$about])*
            #[repr(C)]
            #[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
            pub struct $name { $($(#[$field_about])* pub $field: $kind,)* }

            impl Shared for $name {
                const NAME: &'static str = stringify!($name);
                const FIELDS: &'static [(&'static str, usize)] =
                    &[$((stringify!($field), std::mem::offset_of!($name, $field)),)*];
            }
        )*

        /// Name, size and fields of every shared struct.
        pub const SHARED_STRUCTS: &[(&str, usize, &[(&str, usize)])] =
            &[$(($name::NAME, size_of::<$name>(), $name::FIELDS),)*];
    };
}

shared! {
    /// A ray, 32 bytes. `t` is measured in units of `direction`'s length; hits with
    /// `t_min <= t <= t_max` count. A *dead* ray has `t_max < t_min` and hits nothing.
    struct Ray {
        /// Origin in world space.
        origin: [f32; 3],
        /// Smallest accepted t, at least 0.
        t_min: f32,
        /// Direction, unit length from all of this project's generators.
        direction: [f32; 3],
        /// Largest accepted t.
        t_max: f32,
    }

    /// The nearest hit, 16 bytes; `prim` is [`crate::shared::NO_HIT`] for a miss.
    struct Hit {
        /// Distance in units of the direction's length; the ray's `t_max` for a miss.
        t: f32,
        /// Primitive id.
        prim: u32,
        /// Barycentric weight of the second corner.
        u: f32,
        /// Barycentric weight of the third corner.
        v: f32,
    }

    /// What one ray did in the tree.
    struct RayCounters {
        /// Nodes fetched.
        node_visits: u32,
        /// Triangles tested.
        triangle_tests: u32,
    }

    /// Two-child node, 64 bytes: the boxes of both children and where they are. Each axis holds
    /// `[child 0 low, child 0 high, child 1 low, child 1 high]`, so a node is four 16-byte loads and both
    /// boxes are tested by the same four-lane arithmetic.
    struct Node {
        /// x planes.
        x: [f32; 4],
        /// y planes.
        y: [f32; 4],
        /// z planes.
        z: [f32; 4],
        /// Links of both children; see [`crate::shared::LEAF_BIT`] for the encoding.
        child: [u32; 2],
        /// Zero.
        pad: [u32; 2],
    }

    /// Triangle, 48 bytes, in traversal order: a leaf's triangles are adjacent.
    struct Triangle {
        /// First corner.
        v0: [f32; 3],
        /// Primitive id: index into the scene's triangles.
        prim: u32,
        /// Second corner.
        v1: [f32; 3],
        /// Zero.
        pad1: u32,
        /// Third corner.
        v2: [f32; 3],
        /// Zero.
        pad2: u32,
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

    /// Material as the kernels read it.
    struct Material {
        /// Linear base colour.
        base_color: [f32; 3],
        /// 0 dielectric .. 1 metal.
        metallic: f32,
        /// Emitted radiance.
        emissive: [f32; 3],
        /// Perceptual roughness.
        roughness: f32,
        /// Transmission factor.
        transmission: f32,
        /// Index of refraction.
        ior: f32,
        /// Index of the base-colour texture or [`crate::shared::NO_TEXTURE`].
        texture: u32,
        /// `MATERIAL_*` in [`crate::shared`].
        flags: u32,
    }

    /// Where a texture's texels are.
    struct Texture {
        /// Index of the first texel.
        first: u32,
        /// Texels across.
        width: u32,
        /// Texels down.
        height: u32,
        /// `WRAP_*` of u in bits 0-1, of v in bits 2-3.
        wrap: u32,
    }

    /// Punctual light as the kernels read it.
    struct Light {
        /// World position (point, spot).
        position: [f32; 3],
        /// `LIGHT_*` in [`crate::shared`].
        kind: u32,
        /// Unit direction in which it shines (directional, spot).
        direction: [f32; 3],
        /// 1 / range, 0 if unlimited.
        inverse_range: f32,
        /// Linear intensity.
        intensity: [f32; 3],
        /// Spot cone: fades as `clamp(cos * angle_scale + angle_offset, 0, 1)` squared.
        angle_scale: f32,
        /// See `angle_scale`.
        angle_offset: f32,
        /// Zero.
        pad0: u32,
        /// Zero.
        pad1: u32,
        /// Zero.
        pad2: u32,
    }

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
        /// Samples a pixel.
        samples: u32,
        /// 1 if the sky does not show and alpha is coverage.
        transparent: u32,
        /// 1 if the scene has punctual lights.
        lit: u32,
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
    }

    /// Push constants of the trace kernels.
    struct TracePush {
        /// Address of the nodes.
        nodes: [u32; 2],
        /// Address of the triangles.
        triangles: [u32; 2],
        /// Low corner of the scene.
        scene_low: [f32; 3],
        /// Index of the first ray.
        first: u32,
        /// High corner of the scene.
        scene_high: [f32; 3],
        /// Rays to trace.
        count: u32,
        /// 1 to go on with rays that ran into the step limit.
        resume: u32,
    }

    /// Push constants of all other kernels.
    struct StagePush {
        /// Tile-order index of the batch's first path.
        first: u32,
        /// Paths in the batch.
        count: u32,
        /// Sample number.
        sample_index: u32,
        /// The stage's own: light, ray kind, or 1 for the last sample.
        argument: u32,
    }
}

impl Ray {
    /// A ray that hits nothing and costs nothing.
    pub const DEAD: Ray = Ray { origin: [0.0; 3], t_min: 0.0, direction: [0.0, 0.0, 1.0], t_max: -1.0 };

    /// Whether the ray is to be traced.
    pub fn is_live(&self) -> bool {
        self.t_max >= self.t_min
    }
}

impl Hit {
    /// Whether there is a hit.
    pub fn is_hit(&self) -> bool {
        self.prim != crate::shared::NO_HIT
    }
}
