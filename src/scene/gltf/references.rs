//! Every index of the document is in range and every enumeration value is known, so that the rest of
//! the loader may index freely.

use gltf::json::validation::Checked;
use gltf::json::{Index, Root, texture};

use super::source::Source;
use crate::Result;

/// Checks the references of all objects, used or not; those of accessors are in `accessor.rs`.
pub(super) fn check(source: &Source, root: &Root) -> Result<()> {
    let check = References { source, root };
    if let Some(scene) = root.scene {
        check.index("scene", "scene", scene, root.scenes.len())?;
    }
    for (i, scene) in root.scenes.iter().enumerate() {
        for &node in &scene.nodes {
            check.index(&format!("scene {i}"), "node", node, root.nodes.len())?;
        }
    }
    (0..root.nodes.len()).try_for_each(|i| check.node(i))?;
    (0..root.meshes.len()).try_for_each(|i| check.mesh(i))?;
    (0..root.materials.len()).try_for_each(|i| check.material(i))?;
    (0..root.textures.len()).try_for_each(|i| check.texture(i))?;
    (0..root.images.len()).try_for_each(|i| check.image(i))?;
    for (i, view) in root.buffer_views.iter().enumerate() {
        check.index(&format!("bufferView {i}"), "buffer", view.buffer, root.buffers.len())?;
    }
    Ok(())
}

struct References<'a> {
    source: &'a Source<'a>,
    root: &'a Root,
}

impl References<'_> {
    fn index<T>(&self, object: &str, what: &str, index: Index<T>, len: usize) -> Result<()> {
        if index.value() < len {
            return Ok(());
        }
        let problem = format!("refers to {what} {}, but the file has {len} of them", index.value());
        Err(self.source.fault(object, problem, "correct the index or export the scene again"))
    }

    fn known<T: Copy>(&self, object: &str, what: &str, value: &Checked<T>, allowed: &str) -> Result<()> {
        match value {
            Checked::Valid(_) => Ok(()),
            Checked::Invalid => {
                Err(self.source.fault(object, format!("{what} has an unknown value"), format!("use {allowed}")))
            }
        }
    }

    fn node(&self, i: usize) -> Result<()> {
        let (root, object) = (self.root, format!("node {i}"));
        let node = &root.nodes[i];
        for &child in node.children.iter().flatten() {
            self.index(&object, "child node", child, root.nodes.len())?;
        }
        node.mesh.map_or(Ok(()), |mesh| self.index(&object, "mesh", mesh, root.meshes.len()))?;
        node.camera.map_or(Ok(()), |camera| self.index(&object, "camera", camera, root.cameras.len()))?;
        node.skin.map_or(Ok(()), |skin| self.index(&object, "skin", skin, root.skins.len()))?;
        let light = node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        light.map_or(Ok(()), |light| self.index(&object, "light", light.light, super::light::list(root).len()))
    }

    fn mesh(&self, i: usize) -> Result<()> {
        let root = self.root;
        for (p, primitive) in root.meshes[i].primitives.iter().enumerate() {
            let object = format!("mesh {i}: primitive {p}");
            self.known(&object, "mode", &primitive.mode, "0 (POINTS) to 6 (TRIANGLE_FAN)")?;
            for &accessor in primitive.attributes.values().chain(&primitive.indices) {
                self.index(&object, "accessor", accessor, root.accessors.len())?;
            }
            if let Some(material) = primitive.material {
                self.index(&object, "material", material, root.materials.len())?;
            }
        }
        Ok(())
    }

    fn material(&self, i: usize) -> Result<()> {
        let (object, material) = (format!("material {i}"), &self.root.materials[i]);
        self.known(&object, "alphaMode", &material.alpha_mode, "OPAQUE, MASK or BLEND")?;
        let info = |info: &texture::Info| info.index;
        let pbr = &material.pbr_metallic_roughness;
        let extensions = material.extensions.as_ref();
        let transmission = extensions.and_then(|e| e.transmission.as_ref());
        let volume = extensions.and_then(|e| e.volume.as_ref());
        let textures = [
            pbr.base_color_texture.as_ref().map(info),
            pbr.metallic_roughness_texture.as_ref().map(info),
            material.normal_texture.as_ref().map(|t| t.index),
            material.occlusion_texture.as_ref().map(|t| t.index),
            material.emissive_texture.as_ref().map(info),
            transmission.and_then(|t| t.transmission_texture.as_ref()).map(info),
            volume.and_then(|v| v.thickness_texture.as_ref()).map(info),
        ];
        let mut used = textures.into_iter().flatten();
        used.try_for_each(|texture| self.index(&object, "texture", texture, self.root.textures.len()))
    }

    fn texture(&self, i: usize) -> Result<()> {
        let (root, object) = (self.root, format!("texture {i}"));
        self.index(&object, "image", root.textures[i].source, root.images.len())?;
        let Some(sampler) = root.textures[i].sampler else { return Ok(()) };
        self.index(&object, "sampler", sampler, root.samplers.len())?;
        let (object, sampler) = (format!("sampler {}", sampler.value()), &root.samplers[sampler.value()]);
        let allowed = "10497 (repeat), 33648 (mirrored repeat) or 33071 (clamp to edge)";
        self.known(&object, "wrapS", &sampler.wrap_s, allowed)?;
        self.known(&object, "wrapT", &sampler.wrap_t, allowed)
    }

    fn image(&self, i: usize) -> Result<()> {
        let image = &self.root.images[i];
        match (image.buffer_view, &image.uri) {
            (Some(view), None) => self.index(&format!("image {i}"), "bufferView", view, self.root.buffer_views.len()),
            (None, Some(_)) => Ok(()),
            _ => {
                let problem = "needs either a bufferView or a uri, and not both";
                Err(self.source.fault(format!("image {i}"), problem, "export the scene again"))
            }
        }
    }
}
