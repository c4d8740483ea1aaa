use super::*;
use glam::Vec3;
use xxhash_rust::xxh3::Xxh3;

/// Digest of everything per triangle, in a fixed byte order.
fn digest(scene: &Scene) -> u64 {
    let mut hash = Xxh3::new();
    for corners in scene.positions.iter().chain(&scene.normals) {
        corners.iter().flat_map(|c| c.to_array()).for_each(|c| hash.update(&c.to_bits().to_le_bytes()));
    }
    scene.material_ids.iter().for_each(|id| hash.update(&id.to_le_bytes()));
    hash.digest()
}

/// The scenes are the same on every machine. A digest changes only when its recipe is changed on purpose.
#[test]
fn digests_repeat() {
    let expected = [
        ("room", 0x3045_8742_cd25_209c),
        ("forest", 0x5b3c_eb98_62c1_3ddc),
        ("blob", 0xcee6_62cb_dfee_fb18),
        ("needles", 0xbc55_a3c8_05ea_50a2),
    ];
    let found = expected.map(|(name, _)| (name, digest(&build(name, 20_000, 1).unwrap())));
    assert_eq!(found, expected, "\nfound {found:#x?}");
}

#[test]
fn counts_are_exact_and_content_is_sound() {
    for recipe in RECIPES {
        for triangles in [1_000, 1_001, 1_777, 5_000, 20_011, 300_000] {
            let name = recipe.name;
            let scene = build(name, triangles, 3).unwrap();
            assert_eq!(scene.positions.len(), triangles, "{name}");
            assert_eq!(scene.material_ids.len(), triangles, "{name}");
            assert!(scene.material_ids.iter().all(|&id| (id as usize) < scene.materials.len()), "{name}");
            assert!(scene.positions.as_flattened().iter().all(|p| p.abs().max_element() < 1e3), "{name}");
            assert!(scene.normals.is_empty() || scene.normals.len() == triangles, "{name}");
            assert!(scene.normals.as_flattened().iter().all(|n| (n.length() - 1.0).abs() < 1e-3), "{name}");
            assert_eq!(scene.cameras[0].name.as_deref(), Some("main"), "{name}");
        }
    }
}

#[test]
fn shading_normals_agree_with_the_winding() {
    for name in ["room", "forest", "blob"] {
        let scene = build(name, 100_000, 2).unwrap();
        let geometric = |[a, b, c]: &[Vec3; 3]| (b - a).cross(c - a);
        let opposed = scene.positions.iter().zip(&scene.normals).filter(|(p, n)| geometric(p).dot(n[0]) < 0.0).count();
        assert!(opposed < 100, "{name}: {opposed} of 100000 normals point to the back");
    }
}

#[test]
fn no_triangle_has_zero_area() {
    for recipe in RECIPES {
        let scene = build(recipe.name, 100_000, 2).unwrap();
        let flat = |[a, b, c]: &&[Vec3; 3]| (b - a).cross(c - a).length_squared() == 0.0;
        assert_eq!(scene.positions.iter().filter(flat).count(), 0, "{}", recipe.name);
    }
}

#[test]
fn seeds_matter() {
    for recipe in RECIPES {
        let [one, two] = [1, 2].map(|seed| digest(&build(recipe.name, 20_000, seed).unwrap()));
        assert_ne!(one, two, "{}", recipe.name);
    }
}

/// What the scene is for: triangles of very different sizes.
#[test]
fn room_is_tessellated_unevenly() {
    let scene = build("room", 20_000, 1).unwrap();
    let mut areas: Vec<f32> = scene.positions.iter().map(|[a, b, c]| (b - a).cross(c - a).length()).collect();
    areas.sort_by(f32::total_cmp);
    assert!(areas[areas.len() - 1] > 1e4 * areas[areas.len() / 2]);
}

/// What the scene is for: every needle's box fills much of the cube.
#[test]
fn needles_are_thin_and_diagonal() {
    let scene = build("needles", 10_000, 1).unwrap();
    for [a, b, c] in &scene.positions {
        let extent = a.max(*b).max(*c) - a.min(*b).min(*c);
        assert!(extent.min_element() > 0.6, "box of {extent}");
        assert!((b - a).cross(c - a).length() < 0.02);
        assert!(a.max(*b).max(*c).max_element() <= 1.0);
    }
}

#[test]
fn bad_requests_are_usage_errors() {
    let unknown = build("castle", 5_000, 1).unwrap_err();
    assert_eq!(unknown.exit_code(), 2);
    assert_eq!(unknown.to_string(), "unknown procedural scene \"castle\"; known scenes: room, forest, blob, needles");
    for triangles in [0, 999, 10_000_001, usize::MAX] {
        let error = build("room", triangles, 1).unwrap_err().to_string();
        assert!(error.contains("1000 to 10000000"), "{error}");
    }
}
