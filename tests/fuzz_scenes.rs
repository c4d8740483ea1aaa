//! Whatever happens to the bytes of a scene, loading returns: with a scene or an error, without a panic and
//! in bounded memory. More cases: `PROPTEST_CASES=100000 cargo test --release --test fuzz_scenes`.

mod gltf_files;

use std::path::Path;

use caribou::scene::{self, Scene};
use gltf_files::{File, floats, image, pack};
use proptest::prelude::*;
use serde_json::json;

/// Small files that between them use all that the loader reads.
fn seeds() -> Vec<File> {
    let mut textured = [image::ImageFormat::Png, image::ImageFormat::Jpeg].map(|format| {
        let mut file = File::triangle();
        file.texture(&image(format));
        file.json["materials"][0]["emissiveTexture"] = json!({"index": 0});
        file
    });
    textured[0].json["materials"][0]["extensions"] = json!({
        "KHR_materials_ior": {"ior": 1.5},
        "KHR_materials_transmission": {"transmissionFactor": 0.5},
        "KHR_materials_emissive_strength": {"emissiveStrength": 2},
    });

    let mut placed = File::triangle();
    placed.json["cameras"] = json!([
        {"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}},
        {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0, "zfar": 1}},
    ]);
    placed.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    let spot =
        json!({"type": "spot", "intensity": 2, "range": 3, "spot": {"innerConeAngle": 0.1, "outerConeAngle": 1}});
    placed.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [spot]}});
    placed.json["nodes"] = json!([
        {"children": [1, 2], "translation": [1, 2, 3], "rotation": [0, 0, 0, 1], "scale": [1, -2, 1]},
        {"mesh": 0, "camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"mesh": 0, "camera": 1, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1]},
    ]);

    let mut sparse = File::triangle();
    let (indices, values) = (sparse.view(&[1]), sparse.view(&floats(&[2.0; 3])));
    sparse.json["accessors"][0]["sparse"] = json!({
        "count": 1,
        "indices": {"bufferView": indices, "componentType": 5121},
        "values": {"bufferView": values},
    });
    let normals = sparse.accessor(&floats(&[0.0, 0.0, 1.0].repeat(3)), 5126, "VEC3", 3);
    sparse.primitive()["attributes"]["NORMAL"] = json!(normals);
    sparse.primitive()["mode"] = json!(5);

    textured.into_iter().chain([placed, sparse]).collect()
}

/// Numbers at which arithmetic and tables end.
const EDGES: [&str; 16] = [
    "0",
    "1",
    "-1",
    "2",
    "3",
    "255",
    "65535",
    "65536",
    "2147483647",
    "4294967295",
    "4294967296",
    "1e39",
    "9223372036854775807",
    "18446744073709551615",
    "0.5",
    "1e-40",
];

/// One damage; positions are taken modulo the length.
#[derive(Clone, Debug)]
enum Damage {
    Byte(usize, u8),
    Truncate(usize),
    /// Replaces the n-th number of the JSON text.
    Number(usize, usize),
    /// Replaces the n-th number by a copy of another one.
    SwapNumber(usize, usize),
    /// Removes the n-th pair of a key and its value's first token, or whatever is there.
    Remove(usize, usize),
}

fn damage() -> impl Strategy<Value = Damage> {
    prop_oneof![
        3 => (any::<usize>(), any::<u8>()).prop_map(|(at, byte)| Damage::Byte(at, byte)),
        1 => any::<usize>().prop_map(Damage::Truncate),
        4 => (any::<usize>(), 0..EDGES.len()).prop_map(|(n, edge)| Damage::Number(n, edge)),
        2 => (any::<usize>(), any::<usize>()).prop_map(|(n, m)| Damage::SwapNumber(n, m)),
        1 => (any::<usize>(), 1..40usize).prop_map(|(at, length)| Damage::Remove(at, length)),
    ]
}

fn apply(bytes: &mut Vec<u8>, damage: &Damage) {
    if bytes.is_empty() {
        return;
    }
    let length = bytes.len();
    match *damage {
        Damage::Byte(at, byte) => bytes[at % length] = byte,
        Damage::Truncate(to) => bytes.truncate(to % length),
        Damage::Number(n, edge) => replace_number(bytes, n, |_| EDGES[edge].as_bytes().to_vec()),
        Damage::SwapNumber(n, m) => {
            let numbers = numbers(bytes);
            if let Some(from) = numbers.get(m % numbers.len().max(1)).cloned() {
                let copy = bytes[from].to_vec();
                replace_number(bytes, n, |_| copy);
            }
        }
        Damage::Remove(at, count) => {
            let at = at % length;
            bytes.drain(at..(at + count).min(length));
        }
    }
}

/// Where the runs of digits and signs are.
fn numbers(bytes: &[u8]) -> Vec<std::ops::Range<usize>> {
    let digit = |b: &u8| b.is_ascii_digit() || b"+-.".contains(b);
    let mut found = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let length = bytes[at..].iter().take_while(|b| digit(b)).count();
        if length > 0 {
            found.push(at..at + length);
        }
        at += length + 1;
    }
    found
}

fn replace_number(bytes: &mut Vec<u8>, n: usize, with: impl FnOnce(&[u8]) -> Vec<u8>) {
    let numbers = numbers(bytes);
    if let Some(range) = numbers.get(n % numbers.len().max(1)).cloned() {
        let new = with(&bytes[range.clone()]);
        bytes.splice(range, new);
    }
}

/// What every loaded scene promises.
fn check(scene: &Scene) {
    let triangles = scene.positions.len();
    assert!(scene.positions.iter().flatten().all(|p| p.is_finite()));
    assert_eq!(scene.material_ids.len(), triangles);
    assert!(scene.material_ids.iter().all(|&id| (id as usize) < scene.materials.len()));
    assert!(scene.normals.is_empty() || scene.normals.len() == triangles);
    assert!(scene.normals.iter().flatten().all(|n| (n.length() - 1.0).abs() < 1e-5));
    assert!(scene.uvs.is_empty() || scene.uvs.len() == triangles);
    assert!(scene.uvs.iter().flatten().all(|uv| uv.is_finite()));
    assert!(scene.cameras.iter().all(|camera| camera.world_from_camera.is_finite()));
    for texture in &scene.textures {
        assert_eq!(texture.texels.len() as u64, u64::from(texture.width) * u64::from(texture.height));
    }
    for material in &scene.materials {
        let unit = [material.metallic, material.roughness, material.transmission];
        assert!(unit.iter().chain(&material.base_color).all(|x| (0.0..=1.0).contains(x)), "{material:?}");
        assert!(material.emissive.iter().all(|x| x.is_finite()) && material.ior >= 1.0, "{material:?}");
        assert!(material.base_color_texture.is_none_or(|t| (t as usize) < scene.textures.len()));
    }
    assert!(scene::framing_camera(scene).world_from_camera.is_finite());
}

/// The most memory that this process ever held, in bytes.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? * 1024)
}

fn check_memory() {
    let Some(peak) = peak_memory() else { return eprintln!("SKIPPED: peak memory is not known here") };
    assert!(peak < 1 << 30, "held {peak} bytes for files of 1 KB");
}

/// `cases`, or as many as `PROPTEST_CASES` says.
fn config(cases: u32) -> ProptestConfig {
    let cases = std::env::var("PROPTEST_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(cases);
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(config(500))]

    /// Damage to the document and the data, inside an intact container.
    #[test]
    fn damaged_parts(
        seed in 0..4usize,
        in_json in prop::collection::vec(damage(), 0..4),
        in_bin in prop::collection::vec(damage(), 0..3),
    ) {
        let file = seeds().swap_remove(seed);
        let (mut json, mut bin) = (file.json.to_string().into_bytes(), file.bin);
        in_json.iter().for_each(|damage| apply(&mut json, damage));
        in_bin.iter().for_each(|damage| apply(&mut bin, damage));
        if let Ok(scene) = scene::load_slice("fuzz", &pack(&json, &bin)) {
            check(&scene);
        }
        check_memory();
    }

    /// Damage anywhere in a GLB.
    #[test]
    fn damaged_glb(seed in 0..4usize, damages in prop::collection::vec(damage(), 1..4)) {
        let mut bytes = seeds().swap_remove(seed).glb();
        damages.iter().for_each(|damage| apply(&mut bytes, damage));
        if let Ok(scene) = scene::load_slice("fuzz", &bytes) {
            check(&scene);
        }
        check_memory();
    }

    /// Damage anywhere in a JSON file with data URIs.
    #[test]
    fn damaged_gltf(seed in 0..4usize, damages in prop::collection::vec(damage(), 1..4)) {
        let mut bytes = seeds().swap_remove(seed).gltf();
        damages.iter().for_each(|damage| apply(&mut bytes, damage));
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("fuzz.gltf");
        std::fs::write(&path, &bytes).expect("writable");
        if let Ok(scene) = scene::load(&path) {
            check(&scene);
        }
        check_memory();
    }
}

#[test]
fn undamaged_seeds_load() {
    for file in seeds() {
        check(&scene::load_slice("seed", &file.glb()).expect("legal"));
        assert!(scene::load(Path::new("no such file")).is_err());
    }
}
