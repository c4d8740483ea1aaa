//! Twin of `surface.glsl`: the surface at a hit.

use glam::Vec3;

use super::texture::texture_color;
use super::vec::{cross3, dot3, floored3, max3, normalize3};
use crate::bvh::Bvh;
use crate::layout::{Frame, Hit, Material, Ray};
use crate::scene::tables::Tables;
use crate::shared::{COORDINATE_FLOOR, SURFACE_OFFSET};

/// What the shading kernels read: the scene, and the frame that they all share.
#[derive(Clone, Copy)]
pub struct Stage<'a> {
    /// Triangles by place, and the place of each primitive.
    pub bvh: &'a Bvh,
    /// Materials, textures, lights and attributes.
    pub tables: &'a Tables,
    /// Camera, sky and limits.
    pub frame: &'a Frame,
}

/// A point on a surface, see `surface.glsl`.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// The point, moved off to the side that the ray came from.
    pub position: Vec3,
    /// The point, moved off to the other side.
    pub below: Vec3,
    /// Unit geometric normal on the ray's side.
    pub geometric: Vec3,
    /// Unit shading normal on the ray's side.
    pub normal: Vec3,
    /// Base colour, texture included.
    pub color: Vec3,
    /// The material.
    pub material: Material,
    /// Whether the ray met the side from which the corners run counter-clockwise.
    pub front: bool,
}

/// Octahedral decoding (Cigolle et al. 2014) of two signed 16-bit numbers.
pub fn decode_normal(packed: u32) -> Vec3 {
    let x = f32::from(packed as u16 as i16) * 3.051_851e-5;
    let y = f32::from((packed >> 16) as u16 as i16) * 3.051_851e-5;
    let z = 1.0 - x.abs() - y.abs();
    let fold = (-z).max(0.0);
    let folded = |c: f32| if c < 0.0 { c + fold } else { c - fold };
    normalize3(Vec3::new(folded(x), folded(y), z))
}

fn shading_normal(tables: &Tables, prim: u32, weights: Vec3, geometric: Vec3) -> Vec3 {
    if tables.normals.is_empty() {
        return geometric;
    }
    let [a, b, c] = tables.normals[prim as usize].map(decode_normal);
    let n = normalize3((a * weights.x + b * weights.y) + c * weights.z);
    let side = dot3(n, geometric);
    if side > 0.0 {
        n
    } else if side < 0.0 {
        -n
    } else {
        geometric
    }
}

/// The surface that `ray` meets at `hit`.
pub fn surface_at(stage: Stage, ray: &Ray, hit: &Hit) -> Surface {
    let triangle = &stage.bvh.triangles[stage.bvh.slots[hit.prim as usize] as usize];
    let [v0, v1, v2] = [triangle.v0, triangle.v1, triangle.v2].map(Vec3::from);
    let weights = Vec3::new((1.0 - hit.u) - hit.v, hit.u, hit.v);
    let point = (v0 * weights.x + v1 * weights.y) + v2 * weights.z;
    let mut geometric = normalize3(cross3(v1 - v0, v2 - v0));
    let front = dot3(geometric, ray.direction.into()) <= 0.0;
    if !front {
        geometric = -geometric;
    }
    let size = max3(v0.abs()).max(max3(v1.abs())).max(max3(v2.abs()));
    let offset = geometric * (size * SURFACE_OFFSET);
    let material = stage.tables.materials[stage.tables.material_ids[hit.prim as usize] as usize];
    Surface {
        position: floored3(point + offset, COORDINATE_FLOOR),
        below: floored3(point - offset, COORDINATE_FLOOR),
        geometric,
        normal: shading_normal(stage.tables, hit.prim, weights, geometric),
        color: Vec3::from(material.base_color) * texture_color(stage.tables, material.texture, hit.prim, weights),
        material,
        front,
    }
}
