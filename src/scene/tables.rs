//! A scene's materials, textures, lights and attributes in the kernels' layout.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::{LightKind, Scene, Wrap};
use crate::layout::{Light, Material, Texture};
use crate::shared::*;

/// What shading reads besides the triangles themselves. Arrays of a feature that the scene lacks are empty.
#[derive(Clone, Debug, Default)]
pub struct Tables {
    /// Material of each primitive.
    pub material_ids: Vec<u32>,
    /// Octahedral corner normals of each primitive, two signed 16-bit numbers each.
    pub normals: Vec<[u32; 3]>,
    /// Corner texture coordinates of each primitive.
    pub uvs: Vec<[Vec2; 3]>,
    /// At least one.
    pub materials: Vec<Material>,
    /// Where each texture's texels are.
    pub textures: Vec<Texture>,
    /// Texels of all textures: R | G << 8 | B << 16, sRGB.
    pub texels: Vec<u32>,
    /// Linear value of each 8-bit sRGB value.
    pub srgb: Vec<f32>,
    /// Punctual lights.
    pub lights: Vec<Light>,
}

impl Tables {
    /// Packs `scene`.
    pub fn new(scene: &Scene) -> Tables {
        let mut texels = Vec::with_capacity(scene.textures.iter().map(|t| t.texels.len()).sum());
        let textures = scene
            .textures
            .iter()
            .map(|texture| {
                let first = texels.len() as u32;
                texels.extend(texture.texels.iter().map(|&[r, g, b, _]| u32::from_le_bytes([r, g, b, 0])));
                let [u, v] = texture.wrap.map(wrap);
                Texture { first, width: texture.width, height: texture.height, wrap: u | v << 2 }
            })
            .collect();
        let default = [super::Material::default()];
        let materials = if scene.materials.is_empty() { &default[..] } else { &scene.materials };
        Tables {
            material_ids: scene.material_ids.clone(),
            normals: scene.normals.par_iter().map(|corners| corners.map(encode_normal)).collect(),
            uvs: scene.uvs.clone(),
            materials: materials.iter().map(material).collect(),
            textures,
            texels,
            srgb: (0..=255).map(srgb_to_linear).collect(),
            lights: scene.lights.iter().map(light).collect(),
        }
    }
}

fn wrap(wrap: Wrap) -> u32 {
    match wrap {
        Wrap::Repeat => WRAP_REPEAT,
        Wrap::Mirror => WRAP_MIRROR,
        Wrap::Clamp => WRAP_CLAMP,
    }
}

/// IEC 61966-2-1, section 4.3.
fn srgb_to_linear(value: u32) -> f32 {
    let c = f64::from(value) / 255.0;
    (if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }) as f32
}

/// Octahedral encoding (Cigolle et al. 2014) in two signed 16-bit numbers.
fn encode_normal(n: Vec3) -> u32 {
    let n = n / (n.x.abs() + n.y.abs() + n.z.abs());
    let sign = |x: f32| if x < 0.0 { -1.0 } else { 1.0 };
    let (x, y) = if n.z >= 0.0 { (n.x, n.y) } else { ((1.0 - n.y.abs()) * sign(n.x), (1.0 - n.x.abs()) * sign(n.y)) };
    let quantised = |c: f32| u32::from((c * 32767.0).round() as i16 as u16);
    quantised(x) | quantised(y) << 16
}

fn material(m: &super::Material) -> Material {
    let unlit = if m.unlit { MATERIAL_UNLIT } else { 0 };
    let solid = if m.solid { MATERIAL_SOLID } else { 0 };
    Material {
        base_color: m.base_color,
        metallic: m.metallic,
        emissive: m.emissive,
        roughness: m.roughness,
        transmission: m.transmission,
        ior: m.ior,
        texture: m.base_color_texture.unwrap_or(NO_TEXTURE),
        flags: unlit | solid,
    }
}

fn light(light: &super::Light) -> Light {
    let packed = Light { intensity: light.intensity, ..bytemuck::Zeroable::zeroed() };
    match light.kind {
        LightKind::Directional { direction } => {
            Light { kind: LIGHT_DIRECTIONAL, direction: direction.into(), ..packed }
        }
        LightKind::Point { position, range } => {
            Light { kind: LIGHT_POINT, position: position.into(), inverse_range: 1.0 / range, ..packed }
        }
        LightKind::Spot { position, direction, range, cos_inner, cos_outer } => {
            // KHR_lights_punctual, section Inner and Outer Cone Angles.
            let scale = 1.0 / (cos_inner - cos_outer).max(0.001);
            Light {
                kind: LIGHT_SPOT,
                position: position.into(),
                direction: direction.into(),
                inverse_range: 1.0 / range,
                angle_scale: scale,
                angle_offset: -cos_outer * scale,
                ..packed
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twin::surface::decode_normal;

    #[test]
    fn normals_survive_packing_within_a_ten_thousandth() {
        for i in 0..10_000 {
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / 10_000.0;
            let angle = i as f32 * 2.399_963;
            let r = (1.0 - z * z).sqrt();
            let n = Vec3::new(r * angle.cos(), r * angle.sin(), z);
            assert!((decode_normal(encode_normal(n)) - n).length() < 1e-4, "{n}");
        }
    }

    #[test]
    fn srgb_ends_are_black_and_white() {
        assert_eq!((srgb_to_linear(0), srgb_to_linear(255)), (0.0, 1.0));
    }
}
