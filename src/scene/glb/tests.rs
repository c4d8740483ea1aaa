use super::*;
use crate::scene::{Camera, Light, LightKind, Material, Projection, Wrap, load_slice, procedural, showcase};
use glam::{Mat4, Vec2, Vec3};
use gltf::Gltf;

/// One triangle a material, with everything that the writer knows.
fn everything() -> Scene {
    let plain = Material { name: Some("plain".into()), ..Material::default() };
    let materials = vec![
        Material { base_color: [0.1, 0.2, 0.3], base_color_texture: Some(0), roughness: 0.4, ..plain.clone() },
        Material { metallic: 1.0, emissive: [0.5, 4.0, 2.0], ..plain.clone() },
        Material { emissive: [0.25, 0.5, 0.0], unlit: true, name: None, ..plain.clone() },
        Material { transmission: 0.75, ior: 1.33, solid: true, roughness: 0.0, ..plain },
    ];
    let triangle = |x: f32| [Vec3::new(x, 0.0, 0.5), Vec3::new(x + 1.0, 0.1, 0.0), Vec3::new(x, 1.0, 0.0)];
    let direction = Vec3::new(0.6, -0.8, 0.0);
    let position = Vec3::new(1.0, 2.0, 3.0);
    let light = |name: &str, kind| Light { name: Some(name.into()), intensity: [4.0, 2.0, 1.0], kind };
    Scene {
        name: "everything".into(),
        positions: (0..4).map(|i| triangle(i as f32)).collect(),
        material_ids: vec![0, 1, 2, 3],
        normals: vec![[Vec3::Z; 3]; 4],
        uvs: vec![[Vec2::ZERO, Vec2::X, Vec2::Y]; 4],
        materials,
        textures: vec![Texture {
            width: 2,
            height: 1,
            texels: vec![[255, 0, 10, 255], [3, 250, 9, 255]],
            wrap: [Wrap::Mirror, Wrap::Clamp],
        }],
        cameras: vec![
            Camera {
                name: Some("main".into()),
                world_from_camera: Mat4::from_rotation_y(0.5) * Mat4::from_translation(position),
                projection: Projection::Perspective { yfov: 0.7 },
            },
            Camera {
                name: None,
                world_from_camera: Mat4::IDENTITY,
                projection: Projection::Orthographic { xmag: 2.0, ymag: 1.5 },
            },
        ],
        lights: vec![
            light("sun", LightKind::Directional { direction }),
            light("bulb", LightKind::Point { position, range: 12.5 }),
            light(
                "spot",
                LightKind::Spot { position, direction, range: f32::INFINITY, cos_inner: 0.9, cos_outer: 0.8 },
            ),
        ],
        ..Scene::default()
    }
}

/// Triangles with their normals and materials, in the file's order: grouped by material.
fn grouped(scene: &Scene) -> Vec<(u32, [Vec3; 3], Option<[Vec3; 3]>)> {
    let triangle = |i: usize| (scene.material_ids[i], scene.positions[i], scene.normals.get(i).copied());
    let mut triangles: Vec<_> = (0..scene.positions.len()).map(triangle).collect();
    triangles.sort_by_key(|(material, ..)| *material);
    triangles
}

#[test]
fn loading_gives_back_what_was_written() {
    let scene = everything();
    let loaded = load_slice("everything", &to_bytes(&scene, None).unwrap()).unwrap();
    assert_eq!(loaded.report.warnings, Vec::<String>::new());
    assert_eq!(grouped(&loaded), grouped(&scene));
    assert_eq!(loaded.uvs[0], scene.uvs[0]);
    assert_eq!(loaded.materials, scene.materials);
    assert_eq!(loaded.textures, scene.textures);
    for (loaded, written) in loaded.cameras.iter().zip(&scene.cameras) {
        assert_eq!((&loaded.projection, &loaded.name), (&written.projection, &written.name));
        assert!(loaded.world_from_camera.abs_diff_eq(written.world_from_camera, 1e-6));
    }
    for (loaded, written) in loaded.lights.iter().zip(&scene.lights) {
        assert_eq!((&loaded.name, loaded.intensity), (&written.name, written.intensity));
        match (loaded.kind, written.kind) {
            (
                LightKind::Spot { cos_outer: a, direction: d, .. },
                LightKind::Spot { cos_outer: b, direction: e, .. },
            ) => {
                assert!((a - b).abs() < 1e-6 && d.distance(e) < 1e-6);
            }
            (LightKind::Directional { direction: d }, LightKind::Directional { direction: e }) => {
                assert!(d.distance(e) < 1e-6);
            }
            (loaded, written) => assert_eq!(loaded, written),
        }
    }
    assert_eq!((loaded.cameras.len(), loaded.lights.len()), (2, 3));
}

#[test]
fn procedural_and_showcase_scenes_load_back() {
    let procedural = procedural::RECIPES.iter().map(|recipe| procedural::build(recipe.name, 3_000, 1).unwrap());
    for scene in procedural.chain(showcase::SHOWCASES.iter().map(|(_, build)| build())) {
        let loaded = load_slice(&scene.name, &to_bytes(&scene, None).unwrap()).unwrap();
        assert_eq!(loaded.report.warnings, Vec::<String>::new(), "{}", scene.name);
        assert_eq!(loaded.materials, scene.materials, "{}", scene.name);
        let positions = |scene: &Scene| grouped(scene).into_iter().map(|t| (t.0, t.1)).collect::<Vec<_>>();
        assert!(positions(&loaded) == positions(&scene), "{}", scene.name);
    }
}

/// Another reader's view: the `gltf` crate validates, and indices, bounds and counts hold.
#[test]
fn files_are_valid_gltf() {
    for scene in
        [everything(), procedural::build("room", 5_000, 1).unwrap(), procedural::build("needles", 1_000, 1).unwrap()]
    {
        let bytes = to_bytes(&scene, Some("somebody")).unwrap();
        let Gltf { document, blob } = Gltf::from_slice(&bytes).unwrap();
        let asset = &document.as_json().asset;
        assert_eq!(asset.copyright.as_deref(), Some("somebody"));
        assert_eq!(asset.generator.as_deref(), Some(concat!("caribou ", env!("CARGO_PKG_VERSION"))));

        let blob = blob.unwrap();
        let mut triangles = 0;
        for primitive in document.meshes().flat_map(|mesh| mesh.primitives()) {
            let reader = primitive.reader(|_| Some(&blob));
            let points: Vec<Vec3> = reader.read_positions().unwrap().map(Vec3::from).collect();
            let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
            assert!(indices.iter().all(|&index| (index as usize) < points.len()));
            triangles += indices.len() / 3;
            let bounds = primitive.bounding_box();
            let (min, max) = (points.iter().copied().reduce(Vec3::min), points.iter().copied().reduce(Vec3::max));
            assert_eq!((Some(bounds.min.into()), Some(bounds.max.into())), (min, max));
            assert_eq!(reader.read_normals().is_some(), !scene.normals.is_empty());
        }
        assert_eq!(triangles, scene.positions.len());
    }
}

#[test]
fn lengths_and_chunks_follow_the_container_format() {
    let bytes = to_bytes(&everything(), None).unwrap();
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!((&bytes[..4], word(4), word(8)), (&b"glTF"[..], 2, bytes.len()));
    let json_length = word(12);
    assert_eq!((&bytes[16..20], json_length % 4), (&b"JSON"[..], 0));
    let binary = 20 + json_length;
    assert_eq!((&bytes[binary + 4..binary + 8], word(binary) % 4), (&b"BIN\0"[..], 0));
    assert_eq!(binary + 8 + word(binary), bytes.len());
}

#[test]
fn smooth_surfaces_share_vertices() {
    let scene = procedural::build("blob", 20_000, 1).unwrap();
    let file = Gltf::from_slice(&to_bytes(&scene, None).unwrap()).unwrap();
    let vertices: usize =
        file.meshes().flat_map(|m| m.primitives()).map(|p| p.attributes().next().unwrap().1.count()).sum();
    assert!(vertices < 10_500, "{vertices} vertices for 20000 triangles");
}

#[test]
fn a_scene_without_triangles_is_a_valid_file() {
    let scene = Scene { name: "empty".into(), materials: vec![Material::default()], ..Scene::default() };
    let file = Gltf::from_slice(&to_bytes(&scene, None).unwrap()).unwrap();
    assert_eq!((file.meshes().count(), file.blob), (0, None));
}

#[test]
fn write_makes_the_same_bytes_and_leaves_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.glb");
    write(&everything(), &path, None).unwrap();
    assert!(std::fs::read(&path).unwrap() == to_bytes(&everything(), None).unwrap());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn unwritable_target_is_an_io_error() {
    let folder = tempfile::tempdir().unwrap();
    let error = write(&everything(), &folder.path().join("missing/scene.glb"), None).unwrap_err();
    assert!(matches!(error, Error::Io { .. }), "{error}");
    assert_eq!(error.exit_code(), 2);
}
