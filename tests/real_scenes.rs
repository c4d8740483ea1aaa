//! Scenes from other people's programs load with the counts that their collection states.

use std::path::Path;

use caribou::scene::{self, Scene};

/// A file of the collection, which lies beside the repository.
fn shared(file: &str) -> Option<Scene> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/scenes")).join(file);
    if !path.exists() {
        eprintln!("SKIPPED: {} is not there", path.display());
        return None;
    }
    Some(scene::load(&path).expect(file))
}

#[test]
fn triangles_vertices_and_cameras() {
    for (file, triangles, vertices, cameras) in [
        ("dragon.glb", 871_414, Some(435_545), 3),
        ("conference_clean.glb", 277_552, Some(152_571), 3),
        ("buddha_substitute.glb", 1_087_716, Some(543_654), 3),
        ("forest_substitute.glb", 174_117, Some(230_748), 3),
        ("dragon_res2.glb", 202_520, None, 3),
        ("dragon_res3.glb", 47_794, None, 3),
        ("dragon_res4.glb", 11_102, None, 3),
        ("bunny.glb", 69_451, Some(34_834), 3),
        ("sponza_dabrovic.glb", 66_445, Some(66_350), 1),
        ("khronos/MetalRoughSpheresNoTextures.glb", 1_040_409, None, 0),
    ] {
        let Some(scene) = shared(file) else { continue };
        assert_eq!((scene.positions.len(), scene.cameras.len()), (triangles, cameras), "{file}");
        assert!(vertices.is_none_or(|n| n == scene.report.vertices), "{file}: {}", scene.report.vertices);
        assert_eq!(scene.report.warnings, [""; 0], "{file}");
    }
}

#[test]
fn the_dragon_has_its_degenerate_triangles_and_no_attributes() {
    let Some(dragon) = shared("dragon.glb") else { return };
    assert_eq!(dragon.report.degenerate_triangles, 108);
    assert!(dragon.normals.is_empty() && dragon.uvs.is_empty() && dragon.textures.is_empty());
    assert_eq!(dragon.materials, [scene::Material::default()]);
    assert_eq!(scene::select_camera(&dragon, Some("side")).expect("exists"), dragon.cameras[1]);
}

#[test]
fn sponza_has_normals_textures_and_materials() {
    let Some(sponza) = shared("sponza_dabrovic.glb") else { return };
    assert_eq!((sponza.materials.len(), sponza.textures.len()), (19, 10));
    assert_eq!((sponza.normals.len(), sponza.uvs.len()), (66_445, 66_445));
    assert!(sponza.normals.iter().flatten().all(|n| (n.length() - 1.0).abs() < 1e-6));
}

#[test]
fn khronos_samples_say_what_is_left_out() {
    for (file, triangles, words) in [
        ("khronos/TransmissionTest.glb", 128_775, "transmissionTexture"),
        ("khronos/GlassVaseFlowers.glb", 14_036, "normalTexture"),
        ("khronos/TransmissionRoughnessTest.glb", 77_792, "metallicRoughnessTexture"),
        ("khronos/SpecularTest.glb", 44_828, "KHR_materials_specular"),
    ] {
        let Some(scene) = shared(file) else { continue };
        assert_eq!(scene.positions.len(), triangles, "{file}");
        assert!(scene.report.warnings.iter().any(|w| w.contains(words)), "{file}: {:?}", scene.report.warnings);
    }
    let Some(emissive) = shared("khronos/EmissiveStrengthTest.glb") else { return };
    assert!(emissive.materials.iter().any(|material| material.emissive.iter().any(|&e| e > 1.0)));
    assert!(emissive.report.warnings.is_empty());
}
