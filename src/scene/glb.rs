//! Writes a [`Scene`] as binary glTF 2.0: one mesh a material, welded and indexed; cameras and lights as
//! nodes. Triangles come out grouped by material, otherwise in their order.

use super::weld::{Welded, weld};
use super::{Camera, Light, LightKind, Material, Projection, Scene, Texture, Wrap};
use crate::{Error, Result};
use glam::{Mat4, Vec3};
use serde_json::{Map, Value, json};
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writes `scene` to `path`, whole or not at all: the file is written beside its final place, synced and
/// renamed. `copyright` goes into the asset. Fails with [`Error::Io`] if the folder or file is not
/// writable and with [`Error::Usage`] if the scene does not fit the format's 4 GiB.
pub fn write(scene: &Scene, path: &Path, copyright: Option<&str>) -> Result<()> {
    let plan = Plan::new(scene, copyright)?;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    builder.prefix(".caribou-").suffix(".glb");
    #[cfg(unix)]
    {
        // tempfile's own default, 0600, would survive the rename; the umask narrows this as usual.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let file = builder.tempfile_in(folder).map_err(Error::io("create", path))?;

    let mut out = BufWriter::with_capacity(1 << 20, file);
    plan.write_to(&mut out).map_err(Error::io("write", path))?;
    let file = out.into_inner().map_err(|e| Error::io("write", path)(e.into_error()))?;
    file.as_file().sync_all().map_err(Error::io("write", path))?;
    file.persist(path).map_err(|e| Error::io("rename", path)(e.error))?;
    Ok(())
}

/// The bytes that [`write`] would write.
pub fn to_bytes(scene: &Scene, copyright: Option<&str>) -> Result<Vec<u8>> {
    let plan = Plan::new(scene, copyright)?;
    let mut bytes = Vec::with_capacity(plan.file_length() as usize);
    plan.write_to(&mut bytes).map_err(Error::io("write", scene.name.as_str()))?;
    Ok(bytes)
}

/// Everything that has to be known before the first byte: a .glb starts with its lengths and its JSON.
struct Plan<'a> {
    scene: &'a Scene,
    meshes: Vec<Mesh>,
    images: Vec<Vec<u8>>,
    json: Vec<u8>,
    /// Length of the binary chunk, a multiple of 4; no chunk if 0.
    binary_length: u32,
}

/// The triangles of one material.
struct Mesh {
    material: u32,
    welded: Welded,
    textured: bool,
}

impl<'a> Plan<'a> {
    fn new(scene: &'a Scene, copyright: Option<&str>) -> Result<Self> {
        if scene.positions.len() > (u32::MAX / 3) as usize {
            return Err(too_large(scene, 12 * scene.positions.len() as u64));
        }
        let meshes = meshes(scene);
        let images = scene.textures.iter().map(png).collect::<Result<Vec<_>>>()?;
        let mut document = Document::default();
        document.add_meshes(scene, &meshes);
        document.add_textures(&scene.textures, &images);
        document.add_nodes(scene, &meshes);
        let binary_length = document.binary_length.next_multiple_of(4);
        let json = document.finish(scene, copyright).to_string().into_bytes();
        let plan = |binary_length| Plan { scene, meshes, images, json, binary_length };
        match u32::try_from(binary_length) {
            Ok(length) if length < u32::MAX - (64 << 20) => Ok(plan(length)),
            _ => Err(too_large(scene, binary_length)),
        }
    }

    /// JSON chunk length: padded with spaces to a multiple of 4.
    fn json_length(&self) -> u32 {
        self.json.len().next_multiple_of(4) as u32
    }

    fn file_length(&self) -> u32 {
        let binary = if self.binary_length == 0 { 0 } else { 8 + self.binary_length };
        12 + 8 + self.json_length() + binary
    }

    /// Header, JSON chunk, binary chunk (glTF 2.0 section 4.4).
    fn write_to(&self, out: &mut impl Write) -> io::Result<()> {
        let word = |word: u32| word.to_le_bytes();
        out.write_all(b"glTF")?;
        out.write_all(&word(2))?;
        out.write_all(&word(self.file_length()))?;

        out.write_all(&word(self.json_length()))?;
        out.write_all(b"JSON")?;
        out.write_all(&self.json)?;
        out.write_all(&b"   "[..self.json_length() as usize - self.json.len()])?;
        if self.binary_length == 0 {
            return Ok(());
        }

        out.write_all(&word(self.binary_length))?;
        out.write_all(b"BIN\0")?;
        for mesh in &self.meshes {
            for index in &mesh.welded.indices {
                out.write_all(&word(*index))?;
            }
            for attribute in attributes(self.scene, mesh) {
                for &corner in &mesh.welded.first_corners {
                    for component in attribute.of(self.scene, corner) {
                        out.write_all(&component.to_le_bytes())?;
                    }
                }
            }
        }
        for image in &self.images {
            out.write_all(image)?;
            out.write_all(&[0; 3][..image.len().next_multiple_of(4) - image.len()])?;
        }
        Ok(())
    }
}

fn too_large(scene: &Scene, bytes: u64) -> Error {
    Error::usage(
        format!("{}: {bytes} bytes do not fit a .glb file, whose lengths have 32 bits", scene.name),
        "ask for fewer triangles",
    )
}

/// Groups the triangles by material and welds each group.
fn meshes(scene: &Scene) -> Vec<Mesh> {
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
enum Attribute {
    Position,
    Normal,
    TexCoord,
}

impl Attribute {
    fn name(self) -> &'static str {
        match self {
            Attribute::Position => "POSITION",
            Attribute::Normal => "NORMAL",
            Attribute::TexCoord => "TEXCOORD_0",
        }
    }

    /// Floats of the attribute at a corner: 3 or 2.
    fn of(self, scene: &Scene, corner: u32) -> impl Iterator<Item = f32> + use<> {
        let (triangle, k) = (corner as usize / 3, corner as usize % 3);
        let values = match self {
            Attribute::Position => scene.positions[triangle][k].to_array(),
            Attribute::Normal => scene.normals[triangle][k].to_array(),
            Attribute::TexCoord => scene.uvs[triangle][k].extend(0.0).to_array(),
        };
        values.into_iter().take(self.components())
    }

    fn components(self) -> usize {
        if matches!(self, Attribute::TexCoord) { 2 } else { 3 }
    }
}

fn attributes(scene: &Scene, mesh: &Mesh) -> impl Iterator<Item = Attribute> + use<> {
    let normals = (!scene.normals.is_empty()).then_some(Attribute::Normal);
    let uvs = mesh.textured.then_some(Attribute::TexCoord);
    [Some(Attribute::Position), normals, uvs].into_iter().flatten()
}

/// The JSON arrays as they grow. Empty ones are left out: glTF forbids them.
#[derive(Default)]
struct Document {
    buffer_views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
    samplers: Vec<Value>,
    textures: Vec<Value>,
    images: Vec<Value>,
    binary_length: u64,
}

/// glTF's numbers for the OpenGL enumerations that it borrows.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const LINEAR: u32 = 9729;
const LINEAR_MIPMAP_LINEAR: u32 = 9987;

impl Document {
    fn add_meshes(&mut self, scene: &Scene, meshes: &[Mesh]) {
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
    /// [`Plan::write_to`] writes them.
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

    fn add_textures(&mut self, textures: &[Texture], images: &[Vec<u8>]) {
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

    fn add_nodes(&mut self, scene: &Scene, meshes: &[Mesh]) {
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
    }

    fn finish(self, scene: &Scene, copyright: Option<&str>) -> Value {
        let mut asset = json!({ "version": "2.0", "generator": concat!("caribou ", env!("CARGO_PKG_VERSION")) });
        if let Some(copyright) = copyright {
            asset["copyright"] = copyright.into();
        }
        let mut root = Map::new();
        root.insert("asset".into(), asset);

        let mut gltf_scene = json!({ "name": scene.name });
        if !self.nodes.is_empty() {
            gltf_scene["nodes"] = (0..self.nodes.len()).collect();
        }
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

/// A JSON object with this name, if there is one.
fn named(name: Option<&str>) -> Map<String, Value> {
    name.map(|name| ("name".to_owned(), Value::from(name))).into_iter().collect()
}

/// The shortest decimal that reads back as the same f32, as JSON.
fn number(value: f32) -> Value {
    // cannot fail: Rust prints floats in a form that it reads; `value` alone would be widened in binary
    value.to_string().parse::<f64>().map_or(Value::Null, Value::from)
}

fn numbers<const N: usize>(values: [f32; N]) -> Value {
    values.into_iter().map(number).collect()
}

/// All materials are double sided because Caribou culls nothing.
fn material(material: &Material) -> Value {
    let [r, g, b] = material.base_color;
    let mut pbr = json!({
        "baseColorFactor": numbers([r, g, b, 1.0]),
        "metallicFactor": number(material.metallic),
        "roughnessFactor": number(material.roughness),
    });
    if let Some(texture) = material.base_color_texture {
        pbr["baseColorTexture"] = json!({ "index": texture });
    }
    let mut value = named(material.name.as_deref());
    value.insert("pbrMetallicRoughness".into(), pbr);
    value.insert("doubleSided".into(), true.into());

    let mut extensions = Map::new();
    let [r, g, b] = material.emissive;
    let brightest = r.max(g).max(b);
    if brightest > 0.0 {
        // emissiveFactor is limited to 1; what goes beyond is KHR_materials_emissive_strength.
        let strength = brightest.max(1.0);
        value.insert("emissiveFactor".into(), numbers([r, g, b].map(|c| c / strength)));
        if strength > 1.0 {
            extensions
                .insert("KHR_materials_emissive_strength".into(), json!({ "emissiveStrength": number(strength) }));
        }
    }
    if material.transmission > 0.0 {
        extensions.insert(
            "KHR_materials_transmission".into(),
            json!({ "transmissionFactor": number(material.transmission) }),
        );
    }
    if material.solid {
        extensions.insert("KHR_materials_volume".into(), json!({ "thicknessFactor": 1.0 }));
    }
    if material.ior != Material::default().ior {
        extensions.insert("KHR_materials_ior".into(), json!({ "ior": number(material.ior) }));
    }
    if material.unlit {
        extensions.insert("KHR_materials_unlit".into(), json!({}));
    }
    if !extensions.is_empty() {
        value.insert("extensions".into(), extensions.into());
    }
    value.into()
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

/// Near plane in metres; glTF demands one, Caribou has none.
const ZNEAR: f32 = 0.01;
/// Far plane of orthographic cameras in metres, likewise.
const ZFAR: f32 = 10_000.0;

fn camera(camera: &Camera) -> Value {
    let mut value = named(camera.name.as_deref());
    let (kind, lens) = match camera.projection {
        Projection::Perspective { yfov } => ("perspective", json!({ "yfov": number(yfov), "znear": number(ZNEAR) })),
        Projection::Orthographic { xmag, ymag } => (
            "orthographic",
            json!({ "xmag": number(xmag), "ymag": number(ymag), "zfar": number(ZFAR), "znear": number(ZNEAR) }),
        ),
    };
    value.insert("type".into(), kind.into());
    value.insert(kind.into(), lens);
    value.into()
}

fn light(light: &Light) -> Value {
    let mut value = named(light.name.as_deref());
    let [r, g, b] = light.intensity;
    let brightest = r.max(g).max(b);
    let color = if brightest > 0.0 { [r, g, b].map(|c| c / brightest) } else { [1.0; 3] };
    value.insert("color".into(), numbers(color));
    value.insert("intensity".into(), number(brightest));
    let (kind, range) = match light.kind {
        LightKind::Directional { .. } => ("directional", f32::INFINITY),
        LightKind::Point { range, .. } => ("point", range),
        LightKind::Spot { range, cos_inner, cos_outer, .. } => {
            let angle = |cos: f32| number(f64::from(cos).acos() as f32);
            value.insert(
                "spot".into(),
                json!({ "innerConeAngle": angle(cos_inner), "outerConeAngle": angle(cos_outer) }),
            );
            ("spot", range)
        }
    };
    value.insert("type".into(), kind.into());
    if range.is_finite() {
        value.insert("range".into(), number(range));
    }
    value.into()
}

/// The node of a light: it shines along its -z axis.
fn light_frame(kind: &LightKind) -> Mat4 {
    let (position, direction) = match *kind {
        LightKind::Directional { direction } => (Vec3::ZERO, direction),
        LightKind::Point { position, .. } => (position, Vec3::NEG_Z),
        LightKind::Spot { position, direction, .. } => (position, direction),
    };
    let z = -direction;
    let helper = if z.y.abs() < 0.9 { Vec3::Y } else { Vec3::X };
    let x = helper.cross(z).normalize();
    Mat4::from_cols(x.extend(0.0), z.cross(x).extend(0.0), z.extend(0.0), position.extend(1.0))
}

fn wrap_mode(wrap: Wrap) -> u32 {
    match wrap {
        Wrap::Repeat => 10497,
        Wrap::Mirror => 33648,
        Wrap::Clamp => 33071,
    }
}

fn png(texture: &Texture) -> Result<Vec<u8>> {
    use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(texture.texels.as_flattened(), texture.width, texture.height, ExtendedColorType::Rgba8)
        .map_err(|e| Error::usage(format!("texture: {e}"), "give width * height texels"))?;
    Ok(bytes)
}
