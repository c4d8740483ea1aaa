//! glTF materials to [`Material`]: factors in their legal ranges, the base-colour texture, and means in
//! place of the other textures.

use std::ops::RangeInclusive;

use gltf::json::material::AlphaMode;
use gltf::json::validation::Checked;
use gltf::json::{self, Root};

use super::remarks::Remarks;
use super::source::Source;
use super::texture::{Encoding, Textures};
use crate::Result;
use crate::scene::Material;

/// The materials of a file, in its order, and of each the UV set that its texture uses.
pub(super) struct Materials {
    pub list: Vec<Material>,
    pub uv_sets: Vec<Option<u32>>,
}

/// Converts all materials; only those that are `used` get textures.
pub(super) fn convert(
    source: &Source,
    root: &Root,
    used: &[bool],
    textures: &mut Textures,
    remarks: &mut Remarks,
) -> Result<Materials> {
    let (mut list, mut uv_sets) = (Vec::new(), Vec::new());
    for (i, material) in root.materials.iter().enumerate() {
        let mut ranges = Ranges { source, object: format!("material {i}"), remarks };
        let mut converted = factors(&mut ranges, material)?;
        if used[i] {
            add_textures(&mut converted, material, textures, remarks)?;
            remark_unsupported(material, remarks);
        }
        let textured = material.pbr_metallic_roughness.base_color_texture.as_ref().filter(|_| used[i]);
        uv_sets.push(textured.map(|info| info.tex_coord));
        list.push(converted);
    }
    Ok(Materials { list, uv_sets })
}

fn factors(ranges: &mut Ranges, material: &json::Material) -> Result<Material> {
    let pbr = &material.pbr_metallic_roughness;
    let [red, green, blue, _alpha] = pbr.base_color_factor.0;
    let extensions = material.extensions.as_ref();
    let strength = extensions.and_then(|e| e.emissive_strength.as_ref()).map_or(1.0, |e| e.emissive_strength.0);
    let strength = ranges.clamp("emissiveStrength", strength, 0.0..=f32::MAX)?;
    let emissive = ranges.clamp_all("emissiveFactor", material.emissive_factor.0, 0.0..=1.0)?;
    let transmission = extensions.and_then(|e| e.transmission.as_ref()).map_or(0.0, |t| t.transmission_factor.0);
    let ior = extensions.and_then(|e| e.ior.as_ref()).map_or(1.5, |e| e.ior.0);
    // Without a volume, or with a thickness of 0, surfaces are walls without thickness (KHR_materials_volume).
    let thickness = extensions.and_then(|e| e.volume.as_ref()).map_or(0.0, |v| v.thickness_factor.0);
    Ok(Material {
        name: material.name.clone(),
        base_color: ranges.clamp_all("baseColorFactor", [red, green, blue], 0.0..=1.0)?,
        base_color_texture: None,
        metallic: ranges.clamp("metallicFactor", pbr.metallic_factor.0, 0.0..=1.0)?,
        roughness: ranges.clamp("roughnessFactor", pbr.roughness_factor.0, 0.0..=1.0)?,
        emissive: emissive.map(|factor| factor * strength),
        transmission: ranges.clamp("transmissionFactor", transmission, 0.0..=1.0)?,
        ior: ranges.clamp("ior", ior, 1.0..=f32::MAX)?,
        solid: ranges.clamp("thicknessFactor", thickness, 0.0..=f32::MAX)? > 0.0,
        unlit: extensions.is_some_and(|e| e.unlit.is_some()),
    })
}

/// The base-colour texture; of the others only the mean counts, which is nearer to the truth than their
/// factors alone (a metallicFactor is often 1 where the texture says 0).
fn add_textures(
    converted: &mut Material,
    material: &json::Material,
    textures: &mut Textures,
    remarks: &mut Remarks,
) -> Result<()> {
    let mut replace = |what: &str| remarks.add(format!("{what} is not supported; its mean is used"));
    let pbr = &material.pbr_metallic_roughness;
    if let Some(info) = &pbr.base_color_texture {
        converted.base_color_texture = Some(textures.base_color(info.index)?);
    }
    if let Some(info) = &pbr.metallic_roughness_texture {
        let [_, roughness, metallic] = textures.mean(info.index, Encoding::Linear)?;
        converted.roughness *= roughness;
        converted.metallic *= metallic;
        replace("A metallicRoughnessTexture");
    }
    if let Some(info) = &material.emissive_texture {
        let mean = textures.mean(info.index, Encoding::Srgb)?;
        converted.emissive = std::array::from_fn(|c| converted.emissive[c] * mean[c]);
        replace("An emissiveTexture");
    }
    let transmission = material.extensions.as_ref().and_then(|e| e.transmission.as_ref());
    if let Some(info) = transmission.and_then(|t| t.transmission_texture.as_ref()) {
        let [mean, ..] = textures.mean(info.index, Encoding::Linear)?;
        converted.transmission *= mean;
        replace("A transmissionTexture");
    }
    Ok(())
}

fn remark_unsupported(material: &json::Material, remarks: &mut Remarks) {
    let volume = material.extensions.as_ref().and_then(|e| e.volume.as_ref());
    if volume.is_some_and(|v| v.attenuation_distance.0.is_finite() || v.thickness_texture.is_some()) {
        remarks.add("Attenuation and thicknessTexture of a KHR_materials_volume are not supported and left out");
    }
    if material.normal_texture.is_some() {
        remarks.add("A normalTexture is not supported and left out");
    }
    if material.occlusion_texture.is_some() {
        remarks.add("An occlusionTexture is not supported and left out");
    }
    let volume = material.extensions.as_ref().and_then(|e| e.volume.as_ref());
    if volume.is_some_and(|v| v.attenuation_distance.0.is_finite() && v.attenuation_color.0 != [1.0; 3]) {
        remarks.add("Attenuation in volumes is not supported and left out");
    }
    if volume.is_some_and(|v| v.thickness_texture.is_some()) {
        remarks.add("A thicknessTexture is not supported; rays find the thickness themselves");
    }
    if let Checked::Valid(mode @ (AlphaMode::Mask | AlphaMode::Blend)) = material.alpha_mode {
        remarks.add(format!("The alphaMode {mode:?} is not supported; the material is shown opaque"));
    }
}

/// Brings factors into their legal range.
pub(super) struct Ranges<'a> {
    pub source: &'a Source<'a>,
    pub object: String,
    pub remarks: &'a mut Remarks,
}

impl Ranges<'_> {
    /// `value` inside `range`, with a remark if it was outside; an error if it is infinite.
    pub fn clamp(&mut self, what: &str, value: f32, range: RangeInclusive<f32>) -> Result<f32> {
        if !value.is_finite() {
            let problem = format!("{what} is not a finite number");
            return Err(self.source.fault(&self.object, problem, "correct it or export the scene again"));
        }
        if !range.contains(&value) {
            self.remarks.add(format!("{what} is outside its legal range and clamped"));
        }
        Ok(value.clamp(*range.start(), *range.end()))
    }

    /// As [`Ranges::clamp`], for each component.
    pub fn clamp_all(&mut self, what: &str, values: [f32; 3], range: RangeInclusive<f32>) -> Result<[f32; 3]> {
        let [a, b, c] = values.map(|value| self.clamp(what, value, range.clone()));
        Ok([a?, b?, c?])
    }
}
