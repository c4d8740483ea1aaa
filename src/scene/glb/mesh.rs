//! A scene's triangles as the meshes of the file: one a material.

use super::weld::{Welded, weld};
use crate::scene::Scene;

/// The triangles of one material.
pub struct Mesh {
    pub material: u32,
    pub welded: Welded,
    /// Whether texture coordinates are written.
    pub textured: bool,
}

/// Groups the triangles by material and welds each group.
pub fn meshes(scene: &Scene) -> Vec<Mesh> {
    let mut groups = vec![Vec::new(); scene.materials.len()];
    for (triangle, &material) in scene.material_ids.iter().enumerate() {
        groups[material as usize].push(triangle as u32);
    }
    let filled = groups.into_iter().enumerate().filter(|(_, triangles)| !triangles.is_empty());
    filled
        .map(|(material, triangles)| {
            let textured = !scene.uvs.is_empty() && scene.materials[material].base_color_texture.is_some();
            Mesh { material: material as u32, welded: weld(scene, &triangles, textured), textured }
        })
        .collect()
}

/// A vertex attribute, in the order of the file.
#[derive(Clone, Copy)]
pub enum Attribute {
    Position,
    Normal,
    TexCoord,
}

impl Attribute {
    pub fn name(self) -> &'static str {
        match self {
            Attribute::Position => "POSITION",
            Attribute::Normal => "NORMAL",
            Attribute::TexCoord => "TEXCOORD_0",
        }
    }

    /// Floats of the attribute at a corner: 3 or 2.
    pub fn of(self, scene: &Scene, corner: u32) -> impl Iterator<Item = f32> + use<> {
        let (triangle, k) = (corner as usize / 3, corner as usize % 3);
        let values = match self {
            Attribute::Position => scene.positions[triangle][k].to_array(),
            Attribute::Normal => scene.normals[triangle][k].to_array(),
            Attribute::TexCoord => scene.uvs[triangle][k].extend(0.0).to_array(),
        };
        values.into_iter().take(self.components())
    }

    pub fn components(self) -> usize {
        if matches!(self, Attribute::TexCoord) { 2 } else { 3 }
    }
}

/// The attributes that this mesh has, in the order of the file.
pub fn attributes(scene: &Scene, mesh: &Mesh) -> impl Iterator<Item = Attribute> + use<> {
    let normals = (!scene.normals.is_empty()).then_some(Attribute::Normal);
    let uvs = mesh.textured.then_some(Attribute::TexCoord);
    [Some(Attribute::Position), normals, uvs].into_iter().flatten()
}
