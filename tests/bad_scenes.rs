//! Malformed scenes are refused with a message that names the file and the object, and nothing else
//! happens: no panic, hang, stack overflow, huge allocation or read outside the scene's folder.

mod gltf_files;

use std::path::Path;

use caribou::{Error, scene};
use gltf_files::{File, data_uri, floats, image, pack};
use serde_json::json;

/// Writes `bytes` as `name` into `folder` and asserts that loading it fails naming the file and `object`.
fn refused_in(folder: &Path, name: &str, bytes: &[u8], object: &str) {
    let path = folder.join(name);
    std::fs::write(&path, bytes).expect("the folder is writable");
    match scene::load(&path) {
        Err(error @ Error::Input { .. }) => {
            let text = error.to_string();
            assert!(text.contains(name) && text.contains(object), "message must name {name} and {object}: {text}");
            assert_eq!(error.exit_code(), 2);
            assert!(text.len() < 2000, "too long: {text}");
        }
        Err(other) => panic!("{name}: not an input error: {other}"),
        Ok(_) => panic!("{name}: loaded, though {object} is wrong"),
    }
}

fn refused(name: &str, bytes: &[u8], object: &str) {
    refused_in(tempfile::tempdir().expect("a folder").path(), name, bytes, object);
}

/// What is wrong, the object that the message must name, and how a good file is spoiled.
type Case = (&'static str, &'static str, fn(&mut File));

/// Spoils the triangle file in each way and loads it as .glb and as .gltf.
fn all_refused(cases: &[Case]) {
    for (name, object, spoil) in cases {
        let mut file = File::triangle();
        spoil(&mut file);
        refused(&format!("{name}.glb"), &file.glb(), object);
        refused(&format!("{name}.gltf"), &file.gltf(), object);
    }
}

#[test]
fn the_unspoiled_file_loads() {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, bytes) in [("a.glb", File::triangle().glb()), ("a.gltf", File::triangle().gltf())] {
        std::fs::write(folder.path().join(name), bytes).expect("writable");
        assert_eq!(scene::load(&folder.path().join(name)).expect(name).positions.len(), 1);
    }
}

#[test]
fn containers() {
    let good = File::triangle().glb();
    let with = |offset: usize, value: u32| {
        let mut bytes = good.clone();
        bytes[offset..offset + 4].copy_from_slice(&value.to_le_bytes());
        bytes
    };
    refused("empty.glb", b"", "header");
    refused("only-magic.glb", b"glTF", "header");
    refused("wrong-magic.glb", &with(0, 0x4654_4C68), "header");
    refused("json-as.glb", &File::triangle().gltf(), "header");
    refused("glb-as.gltf", &good, "header");
    refused("version-1.glb", &with(4, 1), "header");
    refused("version-3.glb", &with(4, 3), "header");
    refused("truncated.glb", &good[..good.len() - 10], "header");
    refused("trailing.glb", &[&good[..], &[0; 4]].concat(), "header");
    refused("long-json-chunk.glb", &with(12, 0x7FFF_FFFF), "chunk 0");
    refused("huge-json-chunk.glb", &with(12, 0xFFFF_FFFF), "chunk 0");
    refused("first-chunk-not-json.glb", &with(16, 0x004E_4942), "chunk 0");
    refused("no-chunk.glb", &[&b"glTF\x02\0\0\0\x0C\0\0\0"[..]].concat(), "chunk 0");
    refused("half-chunk-header.glb", &[&b"glTF\x02\0\0\0\x10\0\0\0\x01\0\0\0"[..]].concat(), "chunk 0");
    let bin_length = good.len() - File::triangle().bin.len() - 8;
    refused("long-bin-chunk.glb", &with(bin_length, 1 << 30), "chunk 1");
    refused("bin-chunk-too-small.glb", &pack(File::triangle().json.to_string().as_bytes(), &[0; 40]), "buffer 0");
    refused("no-bin-chunk.gltf", File::triangle().json.to_string().as_bytes(), "buffer 0");
}

#[test]
fn json_text() {
    refused("empty.gltf", b"", "JSON");
    refused("not-utf8.gltf", b"{\"asset\":{\"version\":\"\xFF\"}}", "asset");
    refused("unfinished.gltf", b"{\"asset\":{\"version\":\"2.0\"}", "JSON");
    refused("trailing.gltf", b"{\"asset\":{\"version\":\"2.0\"}} x", "JSON");
    refused("not-an-object.gltf", b"[]", "asset");
    refused("huge-number.gltf", b"{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{\"scale\":[1e999,1,1]}]}", "node 0");
    let nested = |open: &str, close: &str| {
        let (open, close) = (open.repeat(200_000), close.repeat(200_000));
        format!("{{\"asset\":{{\"version\":\"2.0\"}},\"extras\":{open}1{close}}}").into_bytes()
    };
    refused("deep-lists.gltf", &nested("[", "]"), "JSON");
    refused("deep-objects.gltf", &nested("{\"a\":", "}"), "JSON");
    refused("deep-and-unclosed.gltf", &[b'['; 200_000], "JSON");
    refused("deep.glb", &pack(&nested("[", "]"), &[]), "JSON");
    let many = format!("{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{}{{}}]}}", "{},".repeat(1 << 20));
    refused("too-many-objects.gltf", many.as_bytes(), "JSON");
    let many = format!("{{\"asset\":{{\"version\":\"2.0\"}},\"extras\":[{}0]}}", "0,".repeat(1 << 24));
    refused("too-many-elements.gltf", many.as_bytes(), "JSON");
}

#[test]
fn versions_and_extensions() {
    all_refused(&[
        ("version-3", "asset", |f| f.json["asset"]["version"] = json!("3.0")),
        ("version-1", "asset", |f| f.json["asset"]["version"] = json!("1.0")),
        ("version-20", "asset", |f| f.json["asset"]["version"] = json!("20")),
        ("no-version", "version is missing", |f| f.json["asset"] = json!({})),
        ("min-version", "minVersion", |f| f.json["asset"]["minVersion"] = json!("2.1")),
        ("version-a-number", "asset.version", |f| f.json["asset"]["version"] = json!(2.0)),
        ("required-unknown", "EXT_made_up", |f| f.json["extensionsRequired"] = json!(["EXT_made_up"])),
        ("required-names-supported", "KHR_materials_ior", |f| f.json["extensionsRequired"] = json!(["EXT_made_up"])),
        ("required-draco", "KHR_draco_mesh_compression", |f| {
            f.json["extensionsRequired"] = json!(["KHR_materials_ior", "KHR_draco_mesh_compression"]);
        }),
        ("required-quantization", "KHR_mesh_quantization", |f| {
            f.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        }),
    ]);
    refused("no-asset.gltf", b"{}", "asset");
    refused("gltf-1.gltf", br#"{"asset":{"version":"1.0"},"nodes":{"a":{}},"meshes":{}}"#, "asset");
}

#[test]
fn references() {
    all_refused(&[
        ("missing-default-scene", "scene 1", |f| f.json["scene"] = json!(1)),
        ("nodes-without-scene", "scenes", |f| {
            let document = f.json.as_object_mut().expect("an object");
            document.remove("scene");
            document.remove("scenes");
        }),
        ("scene-node", "scene 0", |f| f.json["scenes"][0]["nodes"] = json!([7])),
        ("missing-mesh", "node 0", |f| f.json["nodes"][0]["mesh"] = json!(1)),
        ("mesh-wraps-to-0", "node 0: mesh", |f| f.json["nodes"][0]["mesh"] = json!(1u64 << 32)),
        ("negative-mesh", "node 0: mesh", |f| f.json["nodes"][0]["mesh"] = json!(-1)),
        ("mesh-a-string", "node 0: mesh", |f| f.json["nodes"][0]["mesh"] = json!("0")),
        ("long-string", "node 0: mesh", |f| f.json["nodes"][0]["mesh"] = json!("0".repeat(10_000))),
        ("missing-child", "node 0", |f| f.json["nodes"][0]["children"] = json!([9])),
        ("missing-camera", "node 0", |f| f.json["nodes"][0]["camera"] = json!(0)),
        ("missing-skin", "node 0", |f| f.json["nodes"][0]["skin"] = json!(0)),
        ("missing-light", "node 0", |f| {
            f.json["nodes"][0]["extensions"] = json!({"KHR_lights_punctual": {"light": 0}});
        }),
        ("missing-accessor", "mesh 0: primitive 0", |f| f.primitive()["attributes"]["POSITION"] = json!(5)),
        ("accessor-wraps-to-0", "mesh 0", |f| f.primitive()["attributes"]["POSITION"] = json!(1u64 << 32)),
        ("missing-indices", "mesh 0: primitive 0", |f| f.primitive()["indices"] = json!(5)),
        ("missing-material", "mesh 0: primitive 0", |f| f.primitive()["material"] = json!(0)),
        ("unknown-mode", "mesh 0: primitive 0", |f| f.primitive()["mode"] = json!(7)),
        ("mode-wraps-to-4", "mesh 0", |f| f.primitive()["mode"] = json!((1u64 << 32) + 4)),
        ("missing-view", "accessor 0", |f| f.json["accessors"][0]["bufferView"] = json!(2)),
        ("missing-buffer", "bufferView 1", |f| f.json["bufferViews"][1]["buffer"] = json!(1)),
        ("missing-texture", "material 0", |f| {
            f.json["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]);
        }),
        ("missing-normal-texture", "material 0", |f| f.json["materials"] = json!([{"normalTexture": {"index": 3}}])),
        ("unknown-alpha-mode", "material 0", |f| f.json["materials"] = json!([{"alphaMode": "SOLID"}])),
        ("missing-image", "texture 0", |f| f.json["textures"] = json!([{"source": 0}])),
        ("texture-without-source", "texture 0", |f| f.json["textures"] = json!([{}])),
        ("missing-sampler", "texture 0", |f| {
            f.texture(&image(image::ImageFormat::Png));
            f.json["textures"][0]["sampler"] = json!(1);
        }),
        ("unknown-wrap", "sampler 0", |f| {
            f.texture(&image(image::ImageFormat::Png));
            f.json["samplers"][0]["wrapS"] = json!(1);
        }),
        ("image-of-nothing", "image 0", |f| f.json["images"] = json!([{}])),
        ("image-of-missing-view", "image 0", |f| f.json["images"] = json!([{"bufferView": 2}])),
    ]);
}

#[test]
fn accessors() {
    all_refused(&[
        ("count-beyond", "accessor 0", |f| f.json["accessors"][0]["count"] = json!(4)),
        ("count-0", "accessor 0", |f| f.json["accessors"][0]["count"] = json!(0)),
        ("count-negative", "accessor 0", |f| f.json["accessors"][0]["count"] = json!(-3)),
        ("count-fraction", "accessor 0", |f| f.json["accessors"][0]["count"] = json!(2.5)),
        ("count-2^32", "accessor 0", |f| f.json["accessors"][0]["count"] = json!(1u64 << 32)),
        ("count-overflows", "accessor 0", |f| f.json["accessors"][0]["count"] = json!(u64::MAX)),
        ("count-times-size-is-0", "accessor 0", |f| f.json["accessors"][0]["count"] = json!((1u64 << 62) + 1)),
        ("zero-filled-huge", "accessor 0", |f| {
            f.json["accessors"][0] = json!({"componentType": 5126, "type": "VEC3", "count": 1u64 << 40});
        }),
        ("offset-beyond", "accessor 0", |f| f.json["accessors"][0]["byteOffset"] = json!(4)),
        ("offset-overflows", "accessor 0", |f| f.json["accessors"][0]["byteOffset"] = json!(u64::MAX - 35)),
        ("stride-beyond", "accessor 0", |f| f.json["bufferViews"][0]["byteStride"] = json!(16)),
        ("stride-below-size", "accessor 0", |f| f.json["bufferViews"][0]["byteStride"] = json!(4)),
        ("stride-0", "bufferView 0", |f| f.json["bufferViews"][0]["byteStride"] = json!(0)),
        ("stride-odd", "bufferView 0", |f| f.json["bufferViews"][0]["byteStride"] = json!(13)),
        ("stride-huge", "bufferView 0", |f| f.json["bufferViews"][0]["byteStride"] = json!(u64::MAX)),
        ("view-one-byte-short", "accessor 0", |f| f.json["bufferViews"][0]["byteLength"] = json!(35)),
        ("view-beyond", "bufferView 1", |f| f.json["bufferViews"][1]["byteLength"] = json!(9)),
        ("view-offset-overflows", "bufferView 1", |f| {
            f.json["bufferViews"][1]["byteOffset"] = json!(u64::MAX);
        }),
        ("buffer-beyond-file", "buffer 0", |f| f.json["buffers"][0]["byteLength"] = json!(48)),
        ("buffer-huge", "buffer 0", |f| f.json["buffers"][0]["byteLength"] = json!(u64::MAX)),
        ("positions-of-bytes", "accessor 0", |f| f.json["accessors"][0]["componentType"] = json!(5121)),
        ("positions-scalar", "accessor 0", |f| f.json["accessors"][0]["type"] = json!("SCALAR")),
        ("type-unknown", "accessor 0", |f| f.json["accessors"][0]["type"] = json!("VEC5")),
        ("component-unknown", "accessor 0", |f| f.json["accessors"][0]["componentType"] = json!(5130)),
        ("component-wraps", "accessor 0", |f| {
            f.json["accessors"][0]["componentType"] = json!((1u64 << 32) + 5126);
        }),
        ("indices-signed", "accessor 1", |f| f.json["accessors"][1]["componentType"] = json!(5122)),
        ("indices-float", "accessor 2", |f| {
            let indices = f.accessor(&floats(&[0.0, 1.0, 2.0]), 5126, "SCALAR", 3);
            f.primitive()["indices"] = json!(indices);
        }),
        ("index-beyond-vertices", "accessor 1", |f| f.bin[40] = 3),
        ("index-largest", "accessor 1", |f| f.bin[36..38].fill(0xFF)),
        ("normals-too-few", "mesh 0: primitive 0", |f| {
            let normals = f.accessor(&floats(&[0.0; 6]), 5126, "VEC3", 2);
            f.primitive()["attributes"]["NORMAL"] = json!(normals);
        }),
        ("normals-vec2", "accessor 2", |f| {
            let normals = f.accessor(&floats(&[0.0; 6]), 5126, "VEC2", 3);
            f.primitive()["attributes"]["NORMAL"] = json!(normals);
        }),
        ("uvs-vec3", "accessor 3", |f| {
            f.texture(&image(image::ImageFormat::Png));
            let uvs = f.accessor(&floats(&[0.0; 9]), 5126, "VEC3", 3);
            f.primitive()["attributes"]["TEXCOORD_0"] = json!(uvs);
        }),
    ]);
}

#[test]
fn sparse_accessors() {
    /// Replaces vertex `index` with (2, 2, 2) by a sparse part, which `spoil` then breaks.
    fn sparse(f: &mut File, index: u8) {
        let (indices, values) = (f.view(&[index]), f.view(&floats(&[2.0; 3])));
        f.json["accessors"][0]["sparse"] = json!({
            "count": 1,
            "indices": {"bufferView": indices, "componentType": 5121},
            "values": {"bufferView": values},
        });
    }
    all_refused(&[
        ("sparse-index", "accessor 0", |f| sparse(f, 3)),
        ("sparse-count-0", "accessor 0", |f| {
            sparse(f, 0);
            f.json["accessors"][0]["sparse"]["count"] = json!(0);
        }),
        ("sparse-count-beyond", "accessor 0", |f| {
            sparse(f, 0);
            f.json["accessors"][0]["sparse"]["count"] = json!(4);
        }),
        ("sparse-indices-beyond", "accessor 0", |f| {
            sparse(f, 0);
            f.json["accessors"][0]["sparse"]["count"] = json!(2);
        }),
        ("sparse-values-beyond", "accessor 0", |f| {
            sparse(f, 0);
            f.json["accessors"][0]["sparse"]["values"]["byteOffset"] = json!(4);
        }),
        ("sparse-offset-overflows", "accessor 0", |f| {
            sparse(f, 0);
            f.json["accessors"][0]["sparse"]["indices"]["byteOffset"] = json!(u64::MAX);
        }),
        ("sparse-view-missing", "accessor 0", |f| {
            sparse(f, 0);
            f.json["accessors"][0]["sparse"]["indices"]["bufferView"] = json!(99);
        }),
        ("sparse-index-type", "accessor 0", |f| {
            sparse(f, 0);
            f.json["accessors"][0]["sparse"]["indices"]["componentType"] = json!(5126);
        }),
        ("sparse-strided", "accessor 0", |f| {
            sparse(f, 0);
            f.json["bufferViews"][2]["byteStride"] = json!(4);
        }),
    ]);
}

#[test]
fn hierarchies() {
    all_refused(&[
        ("own-child", "node 0", |f| f.json["nodes"][0]["children"] = json!([0])),
        ("cycle", "node", |f| {
            f.json["nodes"] = json!([{"mesh": 0, "children": [1]}, {"children": [2]}, {"children": [0]}]);
        }),
        ("cycle-apart", "node", |f| {
            f.json["nodes"] = json!([{"mesh": 0}, {"children": [2]}, {"children": [1]}]);
        }),
        ("two-parents", "node 2", |f| {
            f.json["nodes"] = json!([{"children": [2]}, {"children": [2]}, {"mesh": 0}]);
        }),
        ("child-twice", "node 1", |f| f.json["nodes"] = json!([{"children": [1, 1]}, {"mesh": 0}])),
        ("root-is-child", "scene 0", |f| {
            f.json["nodes"] = json!([{"children": [1]}, {"mesh": 0}]);
            f.json["scenes"][0]["nodes"] = json!([0, 1]);
        }),
        ("root-twice", "scene 0", |f| f.json["scenes"][0]["nodes"] = json!([0, 0])),
        ("too-many-triangles", "node", |f| {
            // 2,000 instances of 70,000 triangles in a file of a few kilobytes.
            f.json["accessors"][1] = json!({"componentType": 5121, "type": "SCALAR", "count": 210_000});
            f.json["nodes"] = json!(vec![json!({"mesh": 0}); 2000]);
            f.json["scenes"][0]["nodes"] = json!((0..2000).collect::<Vec<_>>());
        }),
        ("too-many-vertices", "node", |f| {
            f.json["accessors"][0] = json!({"componentType": 5126, "type": "VEC3", "count": 4_000_000});
            f.json["nodes"] = json!(vec![json!({"mesh": 0}); 200]);
            f.json["scenes"][0]["nodes"] = json!((0..200).collect::<Vec<_>>());
        }),
        ("too-many-instances", "node", |f| {
            let primitive = f.primitive().clone();
            f.json["meshes"][0]["primitives"] = json!(vec![primitive; 3000]);
            f.json["nodes"] = json!(vec![json!({"mesh": 0}); 3000]);
            f.json["scenes"][0]["nodes"] = json!((0..3000).collect::<Vec<_>>());
        }),
    ]);
}

#[test]
fn numbers_that_are_not_finite() {
    all_refused(&[
        ("position-nan", "accessor 0", |f| f.bin[12..16].copy_from_slice(&f32::NAN.to_le_bytes())),
        ("position-infinite", "accessor 0", |f| f.bin[..4].copy_from_slice(&f32::INFINITY.to_le_bytes())),
        ("translation-infinite", "node 0", |f| f.json["nodes"][0]["translation"] = json!([1e39, 0, 0])),
        ("scale-infinite", "node 0", |f| f.json["nodes"][0]["scale"] = json!([-1e300, 1, 1])),
        ("rotation-zero", "node 0", |f| f.json["nodes"][0]["rotation"] = json!([0, 0, 0, 0])),
        ("rotation-infinite", "node 0", |f| f.json["nodes"][0]["rotation"] = json!([1e39, 0, 0, 1])),
        ("matrix-infinite", "node 0", |f| {
            f.json["nodes"][0]["matrix"] = json!([1e39, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
        }),
        ("matrix-projective", "node 0", |f| {
            f.json["nodes"][0]["matrix"] = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -1, 0, 0, 0, 0]);
        }),
        ("matrix-short", "node 0", |f| f.json["nodes"][0]["matrix"] = json!([1, 0, 0])),
        ("scales-multiply-to-infinity", "node", |f| {
            let nodes: Vec<_> = (0..12).map(|i| json!({"scale": [1e38, 1, 1], "children": [i + 1]})).collect();
            f.json["nodes"] = json!([&nodes[..], &[json!({"mesh": 0})]].concat());
        }),
        ("positions-moved-to-infinity", "node 0", |f| {
            f.bin[12..16].copy_from_slice(&2f32.to_le_bytes());
            f.json["nodes"][0]["scale"] = json!([3e38, 1, 1]);
        }),
        ("material-infinite", "material 0", |f| {
            f.json["materials"] = json!([{"pbrMetallicRoughness": {"roughnessFactor": 1e39}}]);
        }),
    ]);
}

#[test]
fn uris() {
    let folder = tempfile::tempdir().expect("a folder");
    let (inside, outside) = (folder.path().join("scene"), folder.path().join("secret.bin"));
    std::fs::create_dir_all(inside.join("sub")).expect("writable");
    std::fs::write(&outside, [0; 44]).expect("writable");
    std::fs::write(inside.join("short.bin"), [0; 10]).expect("writable");
    let absolute = outside.display().to_string();
    let file_scheme = format!("file://{absolute}");
    let mut uris = vec![
        ("missing.bin", "missing.bin"),
        ("short.bin", "10 bytes"),
        ("", "names no file"),
        ("sub", "not a file"),
        ("../secret.bin", "leaves the scene's folder"),
        ("sub/../../secret.bin", "leaves the scene's folder"),
        ("%2e%2e/secret.bin", "leaves the scene's folder"),
        ("..%2Fsecret.bin", "leaves the scene's folder"),
        ("%FF.bin", "UTF-8"),
        ("a%00.bin", "names no file"),
        ("http://localhost/a.bin", "not a relative path"),
        ("C:/a.bin", "not a relative path"),
        (&absolute, "absolute"),
        (&file_scheme, "not a relative path"),
        ("data:application/octet-stream;base64,AAA*", "does not decode"),
        ("data:application/octet-stream;base64,AAAA", "3 bytes"),
        ("data:text/plain,hello", "not base64"),
        ("data:;base64", "no comma"),
    ];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(&outside, inside.join("link.bin")).expect("writable");
        std::os::unix::fs::symlink(folder.path(), inside.join("up")).expect("writable");
        std::os::unix::fs::symlink("/dev/zero", inside.join("zero.bin")).expect("writable");
        uris.extend([("link.bin", "link"), ("up/secret.bin", "link"), ("zero.bin", "link")]);
    }
    for (uri, problem) in uris {
        let mut file = File::triangle();
        file.json["buffers"][0]["uri"] = json!(uri);
        let text = file.json.to_string();
        refused_in(&inside, "buffer.gltf", text.as_bytes(), "buffer 0");
        refused_in(&inside, "buffer.gltf", text.as_bytes(), problem);
    }
}

#[test]
fn embedded_scenes_read_no_files() {
    let mut file = File::triangle();
    file.json["buffers"][0]["uri"] = json!("Cargo.toml");
    let error = scene::load_slice("builtin:test", &file.glb()).expect_err("reads a file").to_string();
    assert!(error.contains("builtin:test") && error.contains("buffer 0"), "{error}");
    assert!(scene::load_slice("builtin:test", &File::triangle().gltf()).is_err());
}

#[test]
fn images() {
    all_refused(&[
        ("image-garbage", "image 0", |f| f.texture(b"neither a PNG nor a JPEG")),
        ("image-empty", "image 0", |f| f.texture(b"")),
        ("image-truncated", "image 0", |f| {
            let png = image(image::ImageFormat::Png);
            f.texture(&png[..png.len() / 2]);
        }),
        ("image-of-gif", "image 0", |f| f.texture(b"GIF89a\x01\0\x01\0\0\0\0;")),
        ("image-too-large", "image 0", |f| f.texture(&png_header(1 << 20, 1 << 20))),
        ("image-bomb", "image 0", |f| f.texture(&png_header(60_000, 60_000))),
        ("image-both", "image 0", |f| {
            f.texture(&image(image::ImageFormat::Png));
            f.json["images"][0]["uri"] = json!(data_uri(b""));
        }),
        ("image-missing-file", "image 0", |f| {
            f.texture(b"");
            f.json["images"] = json!([{"uri": "missing.png"}]);
        }),
    ]);
}

/// A PNG that claims a size and ends.
fn png_header(width: u32, height: u32) -> Vec<u8> {
    let mut header = b"IHDR".to_vec();
    header.extend([width.to_be_bytes(), height.to_be_bytes()].concat());
    header.extend([8, 6, 0, 0, 0]);
    let mut png = b"\x89PNG\r\n\x1A\n\0\0\0\x0D".to_vec();
    png.extend(&header);
    png.extend(crc32(&header).to_be_bytes());
    png
}

/// The checksum of PNG chunks (ISO/IEC 15948, annex D), bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ (0xEDB8_8320 & (crc & 1).wrapping_neg()))
    })
}

#[test]
fn cameras_and_lights() {
    all_refused(&[
        ("camera-yfov-0", "camera 0", |f| camera(f, json!({"type": "perspective", "perspective": lens(0.0)}))),
        ("camera-yfov-pi", "camera 0", |f| camera(f, json!({"type": "perspective", "perspective": lens(3.2)}))),
        ("camera-no-lens", "camera 0", |f| camera(f, json!({"type": "orthographic", "perspective": lens(1.0)}))),
        ("camera-type", "camera 0", |f| camera(f, json!({"type": "fisheye", "perspective": lens(1.0)}))),
        ("camera-xmag-0", "camera 0", |f| {
            let lens = json!({"xmag": 0, "ymag": 1, "znear": 0, "zfar": 1});
            camera(f, json!({"type": "orthographic", "orthographic": lens}));
        }),
        ("camera-flattened", "node 0", |f| {
            camera(f, json!({"type": "perspective", "perspective": lens(1.0)}));
            f.json["nodes"][0]["scale"] = json!([1, 1, 0]);
        }),
        ("light-type", "light 0", |f| light(f, json!({"type": "area"}))),
        ("light-spot", "light 0", |f| light(f, json!({"type": "spot"}))),
        ("light-infinite", "light 0", |f| light(f, json!({"type": "point", "intensity": 1e39}))),
        ("light-flattened", "light 0", |f| {
            light(f, json!({"type": "directional"}));
            f.json["nodes"][0]["scale"] = json!([1, 1, 0]);
        }),
    ]);
}

fn lens(yfov: f32) -> serde_json::Value {
    json!({"yfov": yfov, "znear": 0.1})
}

fn camera(f: &mut File, camera: serde_json::Value) {
    f.json["cameras"] = json!([camera]);
    f.json["nodes"][0]["camera"] = json!(0);
}

fn light(f: &mut File, light: serde_json::Value) {
    f.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [light]}});
    f.json["nodes"][0]["extensions"] = json!({"KHR_lights_punctual": {"light": 0}});
}

#[test]
fn a_path_that_is_no_file_is_an_error() {
    let folder = tempfile::tempdir().expect("a folder");
    assert!(matches!(scene::load(&folder.path().join("missing.glb")), Err(Error::Io { .. })));
    assert!(matches!(scene::load(folder.path()), Err(Error::Input { .. })));
}
