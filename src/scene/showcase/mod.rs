//! The project's own small scenes, as code. A test builds each again and compares it with the file in
//! `scenes/`; with `CARIBOU_BLESS=1` in the environment it writes the files instead.

mod cornell;
mod courtyard;
mod gallery;

use super::procedural::mesh::{Builder, Frame};
use super::{Material, Scene};

/// Goes into the files' asset.copyright.
pub const COPYRIGHT: &str = "The Caribou project, CC0-1.0";

/// Name and builder of a showcase scene; its file is `scenes/NAME.glb`.
pub type Showcase = (&'static str, fn() -> Scene);

/// All showcase scenes.
pub const SHOWCASES: &[Showcase] =
    &[("cornell", cornell::build), ("courtyard", courtyard::build), ("gallery", gallery::build)];

fn metal(base_color: [f32; 3], roughness: f32) -> Material {
    Material { base_color, metallic: 1.0, roughness, ..Material::default() }
}

fn glass() -> Material {
    Material { roughness: 0.0, transmission: 1.0, ior: 1.5, solid: true, ..Material::default() }
}

/// A box that stands on the frame's origin; `size` is its full extent.
fn standing_block(builder: &mut Builder, material: u32, frame: &Frame, size: [f32; 3]) {
    let half = glam::Vec3::from(size) * 0.5;
    builder.block(material, &frame.shifted(glam::Vec3::Y * half.y), half);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::glb;
    use std::path::Path;

    /// The files in `scenes/` are what this code makes, byte for byte.
    #[test]
    fn files_are_reproducible() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
        for (name, build) in SHOWCASES {
            let path = folder.join(format!("{name}.glb"));
            let made = glb::to_bytes(&build(), Some(COPYRIGHT)).unwrap();
            if std::env::var_os("CARIBOU_BLESS").is_some() {
                std::fs::write(&path, &made).unwrap();
            }
            let kept = std::fs::read(&path).unwrap();
            assert!(made == kept, "{} is out of date: run the tests with CARIBOU_BLESS=1", path.display());
        }
    }

    #[test]
    fn small_and_sound() {
        for (name, build) in SHOWCASES {
            let scene = build();
            assert!(glb::to_bytes(&scene, Some(COPYRIGHT)).unwrap().len() < 300_000, "{name} is too large");
            assert!((2_000..=12_000).contains(&scene.positions.len()), "{name}: {}", scene.positions.len());
            assert_eq!(scene.cameras[0].name.as_deref(), Some("main"), "{name}");
            assert!(!scene.lights.is_empty(), "{name}");
            for ([a, b, c], normals) in scene.positions.iter().zip(&scene.normals) {
                let geometric = (b - a).cross(c - a);
                assert!(geometric.length_squared() > 0.0, "{name}: degenerate triangle at {a}");
                let front = normals.iter().all(|normal| geometric.dot(*normal) > 0.0);
                assert!(front, "{name}: normal to the back at {a} {b} {c}");
            }
        }
    }

    /// What the scenes are there to show.
    #[test]
    fn materials_cover_what_caribou_renders() {
        let all: Vec<Material> = SHOWCASES.iter().flat_map(|(_, build)| build().materials).collect();
        assert!(all.iter().any(|m| m.metallic == 1.0 && m.roughness == 0.0), "mirror");
        assert!(all.iter().any(|m| m.transmission == 1.0 && m.ior == 1.5 && m.roughness == 0.0), "clear glass");
        assert!(all.iter().any(|m| m.emissive[0] > 1.0), "emissive strength");
        assert!(all.iter().any(|m| m.unlit), "unlit");
        assert!(all.iter().any(|m| m.base_color_texture.is_some()), "texture");
        assert!(all.iter().any(|m| m.ior != 1.5), "index of refraction");
    }
}
