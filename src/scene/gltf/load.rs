//! The order in which a file becomes a scene.

use std::path::Path;

use gltf::json::Root;

use super::accessor::Accessors;
use super::buffers::Buffers;
use super::instances::Instance;
use super::remarks::Remarks;
use super::source::Source;
use super::texture::Textures;
use super::uri::{Reader, read_file};
use super::{camera, container, extensions, flatten, instances, json, light, material, nodes, references};
use crate::Result;
use crate::scene::{Material, Scene, SceneReport};

/// Loads a `.glb` or `.gltf` file: the default scene or, without one, scene 0.
///
/// # Errors
///
/// [`crate::Error::Io`] if the file cannot be read, [`crate::Error::Input`] if it is not a legal glTF 2.0
/// file, needs an extension that is not supported, or refers to files outside its folder.
pub fn load(path: &Path) -> Result<Scene> {
    let bytes = read_file(path)?;
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    from_bytes(Source { file: path, folder: Some(folder) }, &bytes)
}

/// Loads a self-contained `.glb` from memory; `name` stands for the file in messages.
///
/// # Errors
///
/// As [`load`]; a reference to any file is an error.
pub fn load_slice(name: &str, glb: &[u8]) -> Result<Scene> {
    from_bytes(Source { file: Path::new(name), folder: None }, glb)
}

fn from_bytes(source: Source, bytes: &[u8]) -> Result<Scene> {
    let container = container::split(&source, bytes)?;
    let root = json::parse(&source, container.json)?;
    references::check(&source, &root)?;
    let mut reader = Reader::new(source);
    let buffers = Buffers::load(&source, &root, container.bin, &mut reader)?;
    let accessors = Accessors::new(source, &root, &buffers)?;

    let mut remarks = Remarks::default();
    extensions::remark_unsupported(&root, &mut remarks);
    remark_unsupported(&root, &mut remarks);
    let placed = nodes::place(&source, &root)?;
    let shapes = instances::shapes(&source, &root, &accessors, &placed, &mut remarks)?;
    let instances = instances::list(&source, &root, &shapes, &placed)?;
    let mut textures = Textures::new(source, &root, &buffers, reader);
    let used = used_materials(&root, &instances);
    let mut materials = material::convert(&source, &root, &used, &mut textures, &mut remarks)?;
    if materials.list.is_empty() || instances.iter().any(|i| i.shape.primitive.material.is_none()) {
        materials.list.push(Material::default());
    }

    let mut scene = Scene {
        name: source.file.display().to_string(),
        materials: materials.list,
        textures: textures.into_decoded(),
        cameras: camera::collect(&source, &root, &placed)?,
        lights: light::collect(&source, &root, &placed, &mut remarks)?,
        report: SceneReport { nodes: placed.len(), ..SceneReport::default() },
        ..Scene::default()
    };
    flatten::flatten(&source, &accessors, &instances, &materials.uv_sets, &mut scene, &mut remarks)?;
    scene.report.warnings = remarks.into_sentences();
    Ok(scene)
}

fn used_materials(root: &Root, instances: &[Instance]) -> Vec<bool> {
    let mut used = vec![false; root.materials.len()];
    for material in instances.iter().filter_map(|instance| instance.shape.primitive.material) {
        used[material.value()] = true;
    }
    used
}

fn remark_unsupported(root: &Root, remarks: &mut Remarks) {
    if !root.animations.is_empty() {
        remarks.add("Animations are not supported; the scene is shown at rest");
    }
    if root.nodes.iter().any(|node| node.skin.is_some()) {
        remarks.add("Skins are not supported; meshes are shown in their bind pose");
    }
}
