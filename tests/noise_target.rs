//! What a noise target promises: the error against a converged picture, and no samples where there is no noise.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use caribou::render::features::Features;
use caribou::render::noise::{LEAST_SAMPLES, TileSums, pixels_of};
use caribou::render::picture::{Picture, Request, picture};
use caribou::render::settings::Settings;
use caribou::scene::tables::Tables;
use caribou::scene::{Scene, builtin, load_slice, select_camera};
use caribou::trace::TracerOptions;
use caribou::twin::resolve::luminance;

const SIZE: (u32, u32) = (40, 32);

fn rendered(scene: &Scene, spp: u32, noise_target: Option<f32>, seed: u32) -> Picture {
    let bvh = common::bvh(scene);
    let tables = Tables::new(scene);
    let camera = select_camera(scene, None).unwrap();
    let (width, height) = SIZE;
    let settings = Settings { width, height, spp, noise_target, seed, ..Settings::default() };
    let features = Features::of(scene, None);
    let tracing = TracerOptions::default();
    let request = Request { bvh: &bvh, tables: &tables, camera: &camera, settings, features, aovs: false, tracing };
    picture(None, &request, &mut |_| {}).unwrap()
}

/// The target bounds standard errors: real errors are above theirs in at most 32 % of the tiles, as those of a normal
/// distribution are above one sigma, and not above three.
#[test]
fn errors_against_a_converged_picture_are_within_the_target() {
    const TARGET: f32 = 0.03;
    const MOST: u32 = 400;
    for name in ["cornell", "courtyard"] {
        let scene = load_slice(name, builtin::builtin(name).unwrap()).unwrap();
        let found = rendered(&scene, MOST, Some(TARGET), 1);
        assert_eq!(found.sampling.tiles_done, found.sampling.tiles, "{name}: {:?}", found.sampling);
        let converged = rendered(&scene, MOST, None, 2);
        let tiles = found.sampling.tiles as u32;
        let errors: Vec<f64> = (0..tiles).map(|tile| displayed_error(tile, &found, &converged)).collect();
        let above = |limit: f32| errors.iter().filter(|&&error| error > f64::from(limit)).count() as u32;
        let count = (above(TARGET), above(3.0 * TARGET));
        assert!(count.0 * 100 <= tiles * 32 && count.1 == 0, "{name}: {count:?} of {tiles} tiles: {errors:?}");
        let mean_square = errors.iter().map(|error| error * error).sum::<f64>() / f64::from(tiles);
        assert!(mean_square.sqrt() <= found.sampling.noise.unwrap() * 1.2, "{name}: {}", mean_square.sqrt());
    }
}

/// As the noise of a tile, with real errors in the place of standard ones.
fn displayed_error(tile: u32, found: &Picture, converged: &Picture) -> f64 {
    let mut sums = TileSums::default();
    for (_, pixel) in pixels_of(tile, SIZE) {
        let [found, expected] = [found, converged].map(|p| f64::from(luminance(p.film.colors()[pixel])));
        sums.pixels += 1;
        sums.luminance += expected;
        sums.squared_error += (found - expected).powi(2);
    }
    sums.noise()
}

#[test]
fn a_picture_of_the_sky_alone_stops_at_the_least_number_of_samples() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("empty.gltf");
    std::fs::write(&path, r#"{"asset": {"version": "2.0"}, "scenes": [{}], "scene": 0}"#).unwrap();
    let scene = caribou::scene::load(&path).unwrap();
    let sampling = rendered(&scene, 1000, Some(0.001), 1).sampling;
    assert_eq!((sampling.min, sampling.max), (LEAST_SAMPLES, LEAST_SAMPLES));
    assert_eq!(sampling.tiles_done, sampling.tiles);
}
