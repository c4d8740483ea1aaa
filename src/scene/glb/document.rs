//! The JSON part of the file.

use super::mesh::{Attribute, Mesh, attributes};
use super::objects::{camera, light, light_frame, material, named, numbers, wrap_mode};
use crate::scene::{Scene, Texture};
use glam::Vec3;
use serde_json::{Map, Value, json};

/// The JSON arrays as they grow. Empty ones are left out: glTF forbids them.
#[derive(Default)]
pub struct Document {
    buffer_views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
    samplers: Vec<Value>,
    textures: Vec<Value>,
    images: Vec<Value>,
    /// Bytes of the binary chunk laid out so far, a multiple of 4.
    pub binary_length: u64,
}

/// glTF's numbers for the OpenGL enumerations that it borrows.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const LINEAR: u32 = 9729;
const LINEAR_MIPMAP_LINEAR: u32 = 9987;

impl Document {
    pub fn add_meshes(&mut self, scene: &Scene, meshes: &[Mesh]) {
        for mesh in meshes {
            let count = mesh.welded.indices.len();
            let view = self.buffer_view(4 * count as u64, Some(ELEMENT_ARRAY_BUFFER));
            let indices = self.accessor(
                json!({ "bufferView": view, "componentType": UNSIGNED_INT, "count": count, "type": "SCALAR" }),
            );
            let mut named = Map::new();
            for attribute in attributes(scene, mesh) {
                named.insert(attribute.name().to_owned(), self.add_attribute(scene, mesh, attribute).into());
            }
            let primitive = json!({ "attributes": named, "indices": indices, "material": mesh.material });
            self.meshes.push(json!({ "name": mesh_name(scene, mesh), "primitives": [primitive] }));
        }
    }

    fn add_attribute(&mut self, scene: &Scene, mesh: &Mesh, attribute: Attribute) -> usize {
        let vertices = &mesh.welded.first_corners;
        let view = self.buffer_view((4 * attribute.components() * vertices.len()) as u64, Some(ARRAY_BUFFER));
        let mut accessor = json!({
            "bufferView": view, "componentType": FLOAT, "count": vertices.len(),
            "type": format!("VEC{}", attribute.components()),
        });
        if matches!(attribute, Attribute::Position) {
            let points = vertices.iter().map(|&corner| scene.positions[corner as usize / 3][corner as usize % 3]);
            let (min, max) =
                points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), point| (min.min(point), max.max(point)));
            accessor["min"] = numbers(min.to_array());
            accessor["max"] = numbers(max.to_array());
        }
        self.accessor(accessor)
    }

    /// Appends a view of the binary chunk and returns its index. Views are laid out in the order in which
    /// `Plan::write_to` writes them.
    fn buffer_view(&mut self, length: u64, target: Option<u32>) -> usize {
        let mut view = json!({ "buffer": 0, "byteOffset": self.binary_length, "byteLength": length });
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.binary_length += length.next_multiple_of(4);
        self.buffer_views.push(view);
        self.buffer_views.len() - 1
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    pub fn add_textures(&mut self, textures: &[Texture], images: &[Vec<u8>]) {
        for (index, (texture, image)) in textures.iter().zip(images).enumerate() {
            let view = self.buffer_view(image.len() as u64, None);
            self.images.push(json!({ "bufferView": view, "mimeType": "image/png" }));
            let [wrap_s, wrap_t] = texture.wrap.map(wrap_mode);
            self.samplers.push(json!({
                "magFilter": LINEAR, "minFilter": LINEAR_MIPMAP_LINEAR, "wrapS": wrap_s, "wrapT": wrap_t,
            }));
            self.textures.push(json!({ "sampler": index, "source": index }));
        }
    }

    pub fn add_nodes(&mut self, scene: &Scene, meshes: &[Mesh]) {
        for (index, mesh) in meshes.iter().enumerate() {
            self.nodes.push(json!({ "name": mesh_name(scene, mesh), "mesh": index }));
        }
        for (index, camera) in scene.cameras.iter().enumerate() {
            let mut node = named(camera.name.as_deref());
            node.insert("camera".into(), index.into());
            node.insert("matrix".into(), numbers(camera.world_from_camera.to_cols_array()));
            self.nodes.push(node.into());
        }
        for (index, light) in scene.lights.iter().enumerate() {
            let mut node = named(light.name.as_deref());
            node.insert("extensions".into(), json!({ "KHR_lights_punctual": { "light": index } }));
            node.insert("matrix".into(), numbers(light_frame(&light.kind).to_cols_array()));
            self.nodes.push(node.into());
        }
        if self.nodes.is_empty() {
            self.nodes.push(json!({ "name": scene.name })); // a scene's list of nodes must not be empty
        }
    }

    /// The whole document.
    pub fn finish(self, scene: &Scene, copyright: Option<&str>) -> Value {
        let mut asset = json!({ "version": "2.0", "generator": concat!("caribou ", env!("CARGO_PKG_VERSION")) });
        if let Some(copyright) = copyright {
            asset["copyright"] = copyright.into();
        }
        let mut root = Map::new();
        root.insert("asset".into(), asset);

        let nodes: Value = (0..self.nodes.len()).collect();
        let gltf_scene = json!({ "name": scene.name, "nodes": nodes });
        let materials: Vec<Value> = scene.materials.iter().map(material).collect();
        let mut extensions_used = extensions_of(&materials);
        if !scene.lights.is_empty() {
            extensions_used.push("KHR_lights_punctual".into());
            let lights: Value = scene.lights.iter().map(light).collect();
            root.insert("extensions".into(), json!({ "KHR_lights_punctual": { "lights": lights } }));
        }
        let buffer = json!({ "byteLength": self.binary_length });
        let arrays = [
            ("extensionsUsed", extensions_used),
            ("scenes", vec![gltf_scene]),
            ("nodes", self.nodes),
            ("cameras", scene.cameras.iter().map(camera).collect()),
            ("meshes", self.meshes),
            ("materials", materials),
            ("textures", self.textures),
            ("images", self.images),
            ("samplers", self.samplers),
            ("accessors", self.accessors),
            ("bufferViews", self.buffer_views),
            ("buffers", if self.binary_length == 0 { Vec::new() } else { vec![buffer] }),
        ];
        for (name, array) in arrays {
            if !array.is_empty() {
                root.insert(name.into(), array.into());
            }
        }
        root.insert("scene".into(), 0.into());
        root.into()
    }
}

fn mesh_name<'a>(scene: &'a Scene, mesh: &Mesh) -> &'a str {
    scene.materials[mesh.material as usize].name.as_deref().unwrap_or("mesh")
}

/// The names of the extensions that any of these objects uses, in order of first use.
fn extensions_of(objects: &[Value]) -> Vec<Value> {
    let mut names: Vec<Value> = Vec::new();
    for extensions in objects.iter().filter_map(|object| object["extensions"].as_object()) {
        for name in extensions.keys().map(|name| Value::from(name.as_str())) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
    }
    names
}
