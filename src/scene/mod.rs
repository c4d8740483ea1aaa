//! Scenes: what a glTF file, a built-in name or a procedural recipe becomes before the BVH is built.

pub mod builtin;
mod framing;
pub mod glb;
mod gltf;
pub mod procedural;
pub mod showcase;
pub mod tables;

use glam::{Mat4, Vec2, Vec3};

pub use framing::{framing_camera, select_camera};
pub use gltf::{load, load_slice};

use crate::shared::COORDINATE_FLOOR;

/// A position with components below [`COORDINATE_FLOOR`] in magnitude as zero: what the triangle test asks of corners.
pub fn floored(position: Vec3) -> Vec3 {
    position.map(|x| if x.abs() < COORDINATE_FLOOR { 0.0 } else { x })
}

/// A scene flattened to world-space triangles. Arrays that run per triangle are parallel; their index
/// is the *primitive id* that hits carry.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// What the user called it: the file's name or `builtin:NAME`.
    pub name: String,
    /// World-space corners of each triangle. Finite; see [`floored`].
    /// Counter-clockwise seen from the front, also in mirrored instances.
    pub positions: Vec<[Vec3; 3]>,
    /// Material of each triangle: an index into `materials`.
    pub material_ids: Vec<u32>,
    /// World-space unit shading normals of each triangle's corners; empty if no mesh has normals.
    /// Triangles of meshes without normals hold their geometric normal.
    pub normals: Vec<[Vec3; 3]>,
    /// Texture coordinates of each triangle's corners; empty if no material has a texture.
    pub uvs: Vec<[Vec2; 3]>,
    /// At least one; the last is glTF's default material if any triangle uses it.
    pub materials: Vec<Material>,
    /// Decoded base-colour textures.
    pub textures: Vec<Texture>,
    /// Cameras in file order; empty if the file has none.
    pub cameras: Vec<Camera>,
    /// Punctual lights in world space.
    pub lights: Vec<Light>,
    /// Counts and remarks for `caribou info`.
    pub report: SceneReport,
}

/// What was found while loading, in the words that the user sees.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct SceneReport {
    /// glTF nodes reached from the scene.
    pub nodes: usize,
    /// Instances of mesh primitives that were flattened.
    pub mesh_instances: usize,
    /// Vertices referenced, summed over instances.
    pub vertices: usize,
    /// Triangles with zero area. They are kept (primitive ids stay in file order) and never hit.
    pub degenerate_triangles: usize,
    /// What is used but unsupported or was left out, one sentence each.
    pub warnings: Vec<String>,
}

/// glTF metallic-roughness material, the parts that the integrator uses.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the file, if any.
    pub name: Option<String>,
    /// Linear base colour factor, 0..1 each.
    pub base_color: [f32; 3],
    /// Texture that multiplies `base_color`: an index into `Scene::textures`.
    pub base_color_texture: Option<u32>,
    /// 0 dielectric .. 1 metal.
    pub metallic: f32,
    /// Perceptual roughness, 0..1.
    pub roughness: f32,
    /// Emitted radiance (emissiveFactor x emissiveStrength), linear.
    pub emissive: [f32; 3],
    /// KHR_materials_transmission factor, 0..1.
    pub transmission: f32,
    /// Index of refraction (KHR_materials_ior), at least 1.
    pub ior: f32,
    /// Transmission goes through a solid and bends (KHR_materials_volume with a thickness above 0);
    /// without it surfaces are infinitely thin walls.
    pub solid: bool,
    /// KHR_materials_unlit: shows `base_color` as it is.
    pub unlit: bool,
}

impl Default for Material {
    /// glTF 2.0's default material, section 3.9.6: white, fully metallic and rough; metalness is
    /// dropped to 0 because a scene without materials should look like clay, not like brushed steel.
    fn default() -> Self {
        Material {
            name: None,
            base_color: [1.0; 3],
            base_color_texture: None,
            metallic: 0.0,
            roughness: 1.0,
            emissive: [0.0; 3],
            transmission: 0.0,
            ior: 1.5,
            solid: false,
            unlit: false,
        }
    }
}

/// A base-colour texture: 8-bit sRGB RGBA, row-major from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// `width * height` texels.
    pub texels: Vec<[u8; 4]>,
    /// Wrap mode of u and v.
    pub wrap: [Wrap; 2],
}

/// glTF sampler wrap mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// Repeat (glTF's default).
    Repeat,
    /// Mirrored repeat.
    Mirror,
    /// Clamp to edge.
    Clamp,
}

/// A camera in world space: looks along -z of its frame, +y up (glTF).
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Name of the camera or, failing that, of its node.
    pub name: Option<String>,
    /// Camera frame to world; orthonormal rotation and translation.
    pub world_from_camera: Mat4,
    /// Lens.
    pub projection: Projection,
}

/// The lens of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// `yfov` in radians, the full vertical angle.
    Perspective {
        /// Full vertical angle in radians, above 0 and below pi.
        yfov: f32,
    },
    /// Half extents of the view in world units.
    Orthographic {
        /// Half width.
        xmag: f32,
        /// Half height.
        ymag: f32,
    },
}

/// A punctual light (KHR_lights_punctual) in world space.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// Name in the file, if any.
    pub name: Option<String>,
    /// Linear colour x intensity (candela for point and spot, lux for directional).
    pub intensity: [f32; 3],
    /// Kind and geometry.
    pub kind: LightKind,
}

/// Kind of a punctual light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// Shines along `direction` (unit) from infinitely far.
    Directional {
        /// Unit direction in which the light travels.
        direction: Vec3,
    },
    /// Shines in all directions; `range` limits it (infinite if absent).
    Point {
        /// World position.
        position: Vec3,
        /// Distance beyond which it gives nothing; `f32::INFINITY` if unlimited.
        range: f32,
    },
    /// A cone about `direction`.
    Spot {
        /// World position.
        position: Vec3,
        /// Unit direction of the cone's axis.
        direction: Vec3,
        /// Distance beyond which it gives nothing; `f32::INFINITY` if unlimited.
        range: f32,
        /// Cosine of the inner cone angle (full light inside).
        cos_inner: f32,
        /// Cosine of the outer cone angle (no light outside).
        cos_outer: f32,
    },
}
