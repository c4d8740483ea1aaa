//! Builds small glTF files for tests.

#![allow(dead_code, reason = "each test program uses a part")]

use serde_json::{Value, json};

/// A glTF document and its binary data, to be edited before it is packed.
pub struct File {
    pub json: Value,
    pub bin: Vec<u8>,
}

impl File {
    /// One triangle (0,0,0) (1,0,0) (0,1,0): accessor 0 has the positions (VEC3 of FLOAT, bytes 0 to 36),
    /// accessor 1 the indices (UNSIGNED_SHORT, bytes 36 to 42).
    pub fn triangle() -> File {
        let positions = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let mut bin: Vec<u8> = positions.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        bin.extend([0u16, 1, 2, 0].iter().flat_map(|i| i.to_le_bytes()));
        let json = json!({
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3},
                {"bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": 3},
            ],
            "bufferViews": [
                {"buffer": 0, "byteOffset": 0, "byteLength": 36},
                {"buffer": 0, "byteOffset": 36, "byteLength": 6},
            ],
            "buffers": [{"byteLength": bin.len()}],
        });
        File { json, bin }
    }

    /// A list of the document, created if it is missing.
    pub fn list(&mut self, name: &str) -> &mut Vec<Value> {
        let list = self.json.as_object_mut().expect("an object").entry(name).or_insert_with(|| json!([]));
        list.as_array_mut().expect("a list")
    }

    /// Appends bytes with an accessor for them and returns its index.
    pub fn accessor(&mut self, bytes: &[u8], component: u32, kind: &str, count: usize) -> usize {
        let view = self.view(bytes);
        let accessors = self.list("accessors");
        accessors.push(json!({"bufferView": view, "componentType": component, "type": kind, "count": count}));
        accessors.len() - 1
    }

    /// Appends bytes with a buffer view for them and returns its index.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.bin.len();
        self.bin.extend(bytes);
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        self.json["buffers"][0]["byteLength"] = json!(self.bin.len());
        let views = self.list("bufferViews");
        views.push(json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}));
        views.len() - 1
    }

    /// The only primitive.
    pub fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    /// Adds a base-colour texture of that image, given as PNG or JPEG.
    pub fn texture(&mut self, image: &[u8]) {
        let uvs = floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
        let (uvs, view) = (self.accessor(&uvs, 5126, "VEC2", 3), self.view(image));
        self.primitive()["attributes"]["TEXCOORD_0"] = json!(uvs);
        self.primitive()["material"] = json!(0);
        self.json["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]);
        self.json["textures"] = json!([{"source": 0, "sampler": 0}]);
        self.json["samplers"] = json!([{"wrapS": 33071, "wrapT": 33648}]);
        self.json["images"] = json!([{"bufferView": view, "mimeType": "image/png"}]);
    }

    /// Binary glTF.
    pub fn glb(&self) -> Vec<u8> {
        pack(self.json.to_string().as_bytes(), &self.bin)
    }

    /// JSON glTF with the data in a URI.
    pub fn gltf(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"][0]["uri"] = json!(data_uri(&self.bin));
        json.to_string().into_bytes()
    }
}

/// A GLB of a JSON and a BIN chunk.
pub fn pack(json: &[u8], bin: &[u8]) -> Vec<u8> {
    let padded = |bytes: &[u8], fill: u8| {
        let mut bytes = bytes.to_vec();
        bytes.resize(bytes.len().next_multiple_of(4), fill);
        bytes
    };
    let (json, bin) = (padded(json, b' '), padded(bin, 0));
    let word = |n: usize| (n as u32).to_le_bytes();
    let length = 12 + 8 + json.len() + 8 + bin.len();
    let header = [*b"glTF", word(2), word(length), word(json.len()), *b"JSON"];
    [&header.concat(), &json[..], &[word(bin.len()), *b"BIN\0"].concat(), &bin[..]].concat()
}

/// `bytes` as a data URI.
pub fn data_uri(bytes: &[u8]) -> String {
    use base64::Engine;
    format!("data:application/octet-stream;base64,{}", base64::engine::general_purpose::STANDARD.encode(bytes))
}

/// Little-endian bytes.
pub fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// A 2 x 1 image: red, then half-transparent blue.
pub fn image(format: image::ImageFormat) -> Vec<u8> {
    let picture = image::RgbaImage::from_raw(2, 1, vec![255, 0, 0, 255, 0, 0, 255, 128]).expect("8 bytes");
    let mut bytes = std::io::Cursor::new(Vec::new());
    let picture = image::DynamicImage::from(picture);
    match format {
        image::ImageFormat::Jpeg => picture.to_rgb8().write_to(&mut bytes, format),
        _ => picture.write_to(&mut bytes, format),
    }
    .expect("memory does not fail");
    bytes.into_inner()
}
