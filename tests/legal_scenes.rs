//! What is legal loads, and means what glTF says: triangle modes, component types, transforms, materials,
//! textures, cameras, lights, and the odd corners of each.

mod gltf_files;

use caribou::scene::{self, Camera, LightKind, Projection, Scene, Wrap};
use glam::{Vec2, Vec3, vec2, vec3};
use gltf_files::{File, floats, image};
use serde_json::json;

const CORNERS: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

fn load(file: &File) -> Scene {
    scene::load_slice("test", &file.glb()).expect("legal")
}

/// The triangle file after an edit.
fn edited(edit: impl FnOnce(&mut File)) -> Scene {
    let mut file = File::triangle();
    edit(&mut file);
    load(&file)
}

fn warned(scene: &Scene, words: &str) -> bool {
    scene.report.warnings.iter().any(|warning| warning.contains(words))
}

/// Five vertices (i, i^2, 0) and no indices.
fn five_vertices(mode: u32) -> Scene {
    edited(|f| {
        let positions: Vec<f32> = (0..5).flat_map(|i| [i as f32, (i * i) as f32, 0.0]).collect();
        let positions = f.accessor(&floats(&positions), 5126, "VEC3", 5);
        *f.primitive() = json!({"attributes": {"POSITION": positions}, "mode": mode});
    })
}

fn corner_numbers(scene: &Scene) -> Vec<[i32; 3]> {
    scene.positions.iter().map(|t| t.map(|p| p.x as i32)).collect()
}

#[test]
fn lists_strips_and_fans() {
    assert_eq!(corner_numbers(&five_vertices(4)), [[0, 1, 2]]);
    assert!(warned(&five_vertices(4), "incomplete triangle"));
    assert_eq!(corner_numbers(&five_vertices(5)), [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
    assert_eq!(corner_numbers(&five_vertices(6)), [[1, 2, 0], [2, 3, 0], [3, 4, 0]]);
}

#[test]
fn points_and_lines_are_left_out_and_said() {
    for mode in 0..4 {
        let scene = five_vertices(mode);
        assert!(scene.positions.is_empty() && warned(&scene, "Points and lines"));
    }
}

#[test]
fn indices_of_every_width() {
    for (component, bytes) in [
        (5121, vec![2u8, 1, 0]),
        (5123, [2u16, 1, 0].iter().flat_map(|i| i.to_le_bytes()).collect()),
        (5125, [2u32, 1, 0].iter().flat_map(|i| i.to_le_bytes()).collect()),
    ] {
        let scene = edited(|f| f.primitive()["indices"] = json!(f.accessor(&bytes, component, "SCALAR", 3)));
        assert_eq!(scene.positions, [[Vec3::Y, Vec3::X, Vec3::ZERO]], "component type {component}");
    }
}

#[test]
fn interleaved_attributes() {
    let scene = edited(|f| {
        let vertex = |p: [f32; 3]| [p, [0.0, 0.0, 2.0]].concat();
        let bytes = floats(&CORNERS.map(|c| vertex(c.to_array())).concat());
        let positions = f.accessor(&bytes, 5126, "VEC3", 3);
        let view = f.json["accessors"][positions]["bufferView"].clone();
        f.json["bufferViews"][2]["byteStride"] = json!(24);
        let normals = json!({"bufferView": view, "byteOffset": 12, "componentType": 5126, "type": "VEC3", "count": 3});
        f.list("accessors").push(normals);
        f.primitive()["attributes"] = json!({"POSITION": positions, "NORMAL": positions + 1});
    });
    assert_eq!(scene.positions, [CORNERS]);
    assert_eq!(scene.normals, [[Vec3::Z; 3]]);
}

#[test]
fn sparse_and_zero_filled_accessors() {
    let scene = edited(|f| {
        let (indices, values) = (f.view(&[1, 2]), f.view(&floats(&[5.0, 0.0, 0.0, 0.0, 6.0, 0.0])));
        let sparse = json!({
            "count": 2,
            "indices": {"bufferView": indices, "componentType": 5121},
            "values": {"bufferView": values},
        });
        f.json["accessors"][0] = json!({"componentType": 5126, "type": "VEC3", "count": 3, "sparse": sparse});
    });
    assert_eq!(scene.positions, [[Vec3::ZERO, Vec3::X * 5.0, Vec3::Y * 6.0]]);
    let scene = edited(|f| f.json["accessors"][0] = json!({"componentType": 5126, "type": "VEC3", "count": 3}));
    assert_eq!(scene.positions, [[Vec3::ZERO; 3]]);
}

#[test]
fn instances_are_placed_through_the_hierarchy() {
    let scene = edited(|f| {
        f.json["nodes"] = json!([
            {"children": [1, 2], "translation": [10, 0, 0], "scale": [2, 2, 2]},
            {"mesh": 0, "translation": [0, 1, 0]},
            {"mesh": 0, "rotation": [0, 0, std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2]},
        ]);
    });
    assert_eq!(scene.positions[0], [vec3(10.0, 2.0, 0.0), vec3(12.0, 2.0, 0.0), vec3(10.0, 4.0, 0.0)]);
    let turned = [vec3(10.0, 0.0, 0.0), vec3(10.0, 2.0, 0.0), vec3(8.0, 0.0, 0.0)];
    assert!(scene.positions[1].iter().zip(turned).all(|(a, b)| a.abs_diff_eq(b, 1e-5)), "{:?}", scene.positions[1]);
    assert_eq!((scene.report.nodes, scene.report.mesh_instances, scene.report.vertices), (3, 2, 6));
}

#[test]
fn matrices_place_like_their_parts() {
    let scene = edited(|f| {
        f.json["nodes"][0]["matrix"] = json!([2, 0, 0, 0, 0, 3, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1]);
    });
    assert_eq!(scene.positions, [[vec3(5.0, 6.0, 7.0), vec3(7.0, 6.0, 7.0), vec3(5.0, 9.0, 7.0)]]);
}

#[test]
fn mirrored_instances_keep_their_outside() {
    for scale in [[-1.0, 1.0, 1.0], [1.0, 1.0, -1.0], [-2.0, -3.0, -0.5], [2.0, 1.0, 1.0]] {
        let scene = edited(|f| {
            let normals = f.accessor(&floats(&[0.6, 0.0, 0.8].repeat(3)), 5126, "VEC3", 3);
            f.primitive()["attributes"]["NORMAL"] = json!(normals);
            f.json["nodes"][0]["scale"] = json!(scale);
        });
        let [a, b, c] = scene.positions[0];
        let (geometric, shading) = ((b - a).cross(c - a), scene.normals[0][0]);
        assert!(geometric.dot(shading) > 0.0, "scale {scale:?}: {geometric} against {shading}");
        assert!((shading.length() - 1.0).abs() < 1e-6);
    }
}

#[test]
fn broken_normals_become_geometric() {
    let scene = edited(|f| {
        let normals = floats(&[0.0, 0.0, 0.0, f32::NAN, 0.0, 1.0, 1.0, 0.0, 0.0]);
        f.primitive()["attributes"]["NORMAL"] = json!(f.accessor(&normals, 5126, "VEC3", 3));
    });
    assert_eq!(scene.normals, [[Vec3::Z, Vec3::Z, Vec3::X]]);
    assert!(warned(&scene, "geometric normal stands in for it (2 times)"));
}

#[test]
fn empty_scenes() {
    for text in [
        r#"{"asset":{"version":"2.0"}}"#,
        r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[]}]}"#,
        r#"{"asset":{"version":"2.1"},"scenes":[{"nodes":[0]}],"nodes":[{}]}"#,
    ] {
        let scene = scene::load_slice("empty", &gltf_files::pack(text.as_bytes(), &[])).expect(text);
        assert!(scene.positions.is_empty() && scene.bounds().is_none());
        assert_eq!(scene.materials.len(), 1, "there is always a material");
        assert!(scene::framing_camera(&scene).world_from_camera.is_finite());
    }
}

#[test]
fn degenerate_triangles_are_kept_and_counted() {
    let scene = edited(|f| {
        let indices = f.accessor(&[0, 1, 2, 0, 1, 1, 2, 2, 2], 5121, "SCALAR", 9);
        f.primitive()["indices"] = json!(indices);
    });
    assert_eq!((scene.positions.len(), scene.report.degenerate_triangles), (3, 2));
}

#[test]
fn the_first_scene_stands_in_for_a_default() {
    let scene = edited(|f| {
        f.json.as_object_mut().expect("an object").remove("scene");
        f.json["scenes"] = json!([{"nodes": [0]}, {"nodes": []}]);
    });
    assert_eq!(scene.positions.len(), 1);
    let other = edited(|f| {
        f.json["scenes"] = json!([{"nodes": [0]}, {"nodes": []}]);
        f.json["scene"] = json!(1);
    });
    assert!(other.positions.is_empty());
}

#[test]
fn a_hundred_thousand_nested_nodes() {
    let scene = edited(|f| {
        let count = 100_000;
        let inner = (0..count).map(|i| json!({"children": [i + 1]}));
        f.json["nodes"] = inner.chain([json!({"mesh": 0})]).collect();
    });
    assert_eq!((scene.report.nodes, scene.positions.len()), (100_001, 1));
}

#[test]
fn files_beside_the_scene() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::create_dir(folder.path().join("data")).expect("writable");
    let mut file = File::triangle();
    for (uri, name) in [
        ("a%20name%20with%20spaces.bin", "a name with spaces.bin"),
        ("plain name.bin", "plain name.bin"),
        ("data/%C3%A4.bin", "data/\u{e4}.bin"),
        ("data/../up.bin", "up.bin"),
    ] {
        std::fs::write(folder.path().join(name), &file.bin).expect("writable");
        file.json["buffers"][0]["uri"] = json!(uri);
        let path = folder.path().join("a.gltf");
        std::fs::write(&path, format!("\u{feff}{}", file.json)).expect("writable");
        assert_eq!(scene::load(&path).expect(uri).positions, [CORNERS]);
    }
}

#[test]
fn materials() {
    let scene = edited(|f| {
        f.primitive()["material"] = json!(0);
        f.json["materials"] = json!([{
            "name": "glass",
            "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 2.0, 0.5], "metallicFactor": 0.5},
            "emissiveFactor": [1, 0.5, 0],
            "extensions": {
                "KHR_materials_emissive_strength": {"emissiveStrength": 4},
                "KHR_materials_transmission": {"transmissionFactor": 0.75},
                "KHR_materials_ior": {"ior": 0.5},
                "KHR_materials_unlit": {},
                "KHR_materials_volume": {"thicknessFactor": 0.1, "attenuationDistance": 2, "attenuationColor": [1, 0, 0]},
            },
        }]);
    });
    let expected = scene::Material {
        name: Some("glass".into()),
        base_color: [0.5, 0.25, 1.0],
        base_color_texture: None,
        metallic: 0.5,
        roughness: 1.0,
        emissive: [4.0, 2.0, 0.0],
        transmission: 0.75,
        ior: 1.0,
        solid: true,
        unlit: true,
    };
    assert_eq!((&scene.materials[..], &scene.material_ids[..]), (&[expected][..], &[0][..]));
    assert!(warned(&scene, "baseColorFactor is outside") && warned(&scene, "ior is outside"));
    assert!(warned(&scene, "Attenuation"));
}

#[test]
fn the_default_material_comes_last_and_only_if_used() {
    let scene = edited(|f| {
        f.json["materials"] = json!([{"name": "used"}, {"name": "unused"}]);
        let mut with_material = f.primitive().clone();
        with_material["material"] = json!(0);
        f.json["meshes"][0]["primitives"].as_array_mut().expect("a list").push(with_material);
    });
    assert_eq!((scene.materials.len(), &scene.material_ids[..]), (3, &[2, 0][..]));
    assert_eq!(scene.materials[2], scene::Material::default());
}

#[test]
fn textures_and_their_coordinates() {
    let scene = edited(|f| f.texture(&image(image::ImageFormat::Png)));
    let texture = &scene.textures[0];
    assert_eq!((texture.width, texture.height, texture.wrap), (2, 1, [Wrap::Clamp, Wrap::Mirror]));
    assert_eq!(texture.texels, [[255, 0, 0, 255], [0, 0, 255, 128]]);
    assert_eq!(scene.uvs, [[Vec2::ZERO, Vec2::X, Vec2::Y]]);
    let jpeg = edited(|f| f.texture(&image(image::ImageFormat::Jpeg)));
    assert_eq!((jpeg.textures[0].width, jpeg.textures[0].height), (2, 1));
    assert!(edited(|_| ()).uvs.is_empty(), "no texture, no coordinates");
}

#[test]
fn normalised_coordinates_and_other_uv_sets() {
    let scene = edited(|f| {
        f.texture(&image(image::ImageFormat::Png));
        let uvs = f.accessor(&[0, 255, 0, 0, 51, 102, 0, 0, 255, 0, 0, 0], 5121, "VEC2", 3);
        let view = f.json["accessors"][uvs]["bufferView"].as_u64().expect("a number") as usize;
        f.json["bufferViews"][view]["byteStride"] = json!(4);
        f.json["accessors"][uvs]["normalized"] = json!(true);
        f.primitive()["attributes"]["TEXCOORD_1"] = json!(uvs);
        f.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = json!(1);
    });
    assert_eq!(scene.uvs, [[vec2(0.0, 1.0), vec2(0.2, 0.4), vec2(1.0, 0.0)]]);
}

#[test]
fn other_textures_count_by_their_mean() {
    let scene = edited(|f| {
        f.texture(&image(image::ImageFormat::Png));
        f.json["materials"][0]["pbrMetallicRoughness"]["metallicRoughnessTexture"] = json!({"index": 0});
        f.json["materials"][0]["emissiveTexture"] = json!({"index": 0});
        f.json["materials"][0]["emissiveFactor"] = json!([1, 1, 1]);
    });
    let material = &scene.materials[0];
    assert_eq!((material.roughness, material.metallic, material.emissive), (0.0, 0.5, [0.5, 0.0, 0.5]));
    assert!(warned(&scene, "metallicRoughnessTexture") && warned(&scene, "emissiveTexture"));
}

#[test]
fn unused_and_shared_images_are_decoded_once_or_not_at_all() {
    let scene = edited(|f| {
        f.texture(&image(image::ImageFormat::Png));
        let material = f.json["materials"][0].clone();
        f.list("materials").push(material);
        let mut second = f.primitive().clone();
        second["material"] = json!(1);
        f.json["meshes"][0]["primitives"].as_array_mut().expect("a list").push(second);
        f.list("materials").push(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}}));
        f.list("textures").push(json!({"source": 1}));
        f.list("images").push(json!({"uri": "missing.png"}));
    });
    assert_eq!(scene.textures.len(), 1);
    let textures: Vec<_> = scene.materials.iter().map(|m| m.base_color_texture).collect();
    assert_eq!(textures, [Some(0), Some(0), None]);
}

#[test]
fn cameras_keep_file_order_and_lose_scale() {
    let scene = edited(|f| {
        f.json["cameras"] = json!([
            {"type": "orthographic", "name": "flat", "orthographic": {"xmag": 2, "ymag": 3, "znear": 0, "zfar": 9}},
            {"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}},
        ]);
        f.json["nodes"] = json!([
            {"camera": 1, "name": "node's name", "translation": [1, 2, 3], "scale": [5, 5, -5]},
            {"camera": 0},
        ]);
        f.json["scenes"][0]["nodes"] = json!([0, 1]);
    });
    let [flat, deep] = &scene.cameras[..] else { panic!("two cameras") };
    assert_eq!((flat.name.as_deref(), deep.name.as_deref()), (Some("flat"), Some("node's name")));
    assert_eq!(flat.projection, Projection::Orthographic { xmag: 2.0, ymag: 3.0 });
    assert_eq!(deep.projection, Projection::Perspective { yfov: 0.5 });
    let frame = deep.world_from_camera;
    assert_eq!(frame.w_axis.truncate(), vec3(1.0, 2.0, 3.0));
    assert_eq!((frame.y_axis.truncate(), frame.z_axis.truncate()), (Vec3::Y, Vec3::NEG_Z));
    assert_eq!(frame.determinant(), 1.0);
}

#[test]
fn lights_in_world_space() {
    let scene = edited(|f| {
        f.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
            {"type": "directional", "name": "sun", "intensity": 2, "color": [1, 0.5, 0.25]},
            {"type": "point", "range": 7},
            {"type": "spot", "spot": {"innerConeAngle": 0.5, "outerConeAngle": 1}},
        ]}});
        let node = |i| json!({"translation": [i, 0, 0], "extensions": {"KHR_lights_punctual": {"light": i}}});
        let mut sun = node(0);
        sun["rotation"] = json!([1, 0, 0, 0]);
        f.json["nodes"] = json!([sun, node(1), node(2)]);
        f.json["scenes"][0]["nodes"] = json!([0, 1, 2]);
    });
    assert_eq!((scene.lights[0].name.as_deref(), scene.lights[0].intensity), (Some("sun"), [2.0, 1.0, 0.5]));
    assert_eq!(scene.lights[0].kind, LightKind::Directional { direction: Vec3::Z });
    assert_eq!(scene.lights[1].kind, LightKind::Point { position: Vec3::X, range: 7.0 });
    let spot = LightKind::Spot {
        position: Vec3::X * 2.0,
        direction: Vec3::NEG_Z,
        range: f32::INFINITY,
        cos_inner: 0.5f32.cos(),
        cos_outer: 1f32.cos(),
    };
    assert_eq!(scene.lights[2].kind, spot);
}

#[test]
fn what_is_left_out_is_said() {
    let scene = edited(|f| {
        f.texture(&image(image::ImageFormat::Png));
        f.json["extensionsUsed"] = json!(["KHR_texture_transform", "KHR_materials_ior"]);
        f.json["animations"] = json!([{"channels": [], "samplers": []}]);
        f.json["skins"] = json!([{"joints": [0]}]);
        f.json["nodes"][0]["skin"] = json!(0);
        f.json["materials"][0]["normalTexture"] = json!({"index": 0});
        f.json["materials"][0]["occlusionTexture"] = json!({"index": 0});
        f.json["materials"][0]["alphaMode"] = json!("BLEND");
        f.primitive()["attributes"]["COLOR_0"] = json!(0);
        f.primitive()["targets"] = json!([{"POSITION": 0}]);
        f.primitive()["attributes"].as_object_mut().expect("an object").remove("TEXCOORD_0");
    });
    for words in [
        "KHR_texture_transform",
        "Animations",
        "Skins",
        "normalTexture",
        "occlusionTexture",
        "Blend",
        "Vertex colours",
        "Morph targets",
        "lacks the texture coordinates",
    ] {
        assert!(warned(&scene, words), "{words} is not in {:?}", scene.report.warnings);
    }
    assert!(!warned(&scene, "KHR_materials_ior"));
    assert_eq!(scene.uvs, [[Vec2::ZERO; 3]]);
}

#[test]
fn cameras_are_chosen_by_name_or_number() {
    let camera = |name: &str, x: f32| Camera {
        name: Some(name.into()),
        world_from_camera: glam::Mat4::from_translation(Vec3::X * x),
        projection: Projection::Perspective { yfov: 1.0 },
    };
    let scene = Scene { cameras: vec![camera("front", 1.0), camera("side", 2.0)], ..Scene::default() };
    let chosen = |which| scene::select_camera(&scene, which).map(|camera| camera.world_from_camera.w_axis.x);
    assert_eq!(chosen(None).expect("the first"), 1.0);
    assert_eq!(chosen(Some("side")).expect("by name"), 2.0);
    assert_eq!(chosen(Some("0")).expect("by number"), 1.0);
    for unknown in ["2", "back", "-1", ""] {
        let error = chosen(Some(unknown)).expect_err("unknown");
        assert!(matches!(error, caribou::Error::Usage { .. }));
        assert!(error.to_string().contains("0 (front), 1 (side)"), "{error}");
    }
}
