//! Whole pictures, rays of every kind and their counters: the device against the twin, bit for bit.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use caribou::bvh::{Bvh, Policy, Quality};
use caribou::render::features::{Features, Indirect};
use caribou::render::picture::{Picture, Request, picture};
use caribou::render::settings::Settings;
use caribou::report::verify::verify_rays;
use caribou::scene::builtin::BUILTINS;
use caribou::scene::tables::Tables;
use caribou::scene::{Scene, load_slice, select_camera};
use caribou::trace::{MachineOptions, Strategy, TracerOptions};
use caribou::vulkan::Gpu;

fn settings(bvh: &Bvh) -> Settings {
    Settings {
        width: 67,
        height: 45,
        spp: 3,
        max_depth: 6,
        seed: 5,
        ao_radius: Settings::default_ao_radius(bvh.bounds),
        ..Settings::default()
    }
}

fn render(
    gpu: Option<&Gpu>,
    scene: &Scene,
    strategy: Strategy,
    (indirect, transparent): (Option<Indirect>, bool),
) -> Picture {
    let bvh = Bvh::build(&scene.positions, Quality::default()).unwrap();
    let tables = Tables::new(scene);
    let camera = select_camera(scene, None).unwrap();
    let features = Features::of(scene, indirect);
    let settings = Settings { transparent, ..settings(&bvh) };
    let machine = MachineOptions { partition: Policy::Bytes(16 << 10), ..MachineOptions::default() };
    let tracing = TracerOptions { strategy, machine, ..TracerOptions::default() };
    let request = Request { bvh: &bvh, tables: &tables, camera: &camera, settings, features, aovs: true, tracing };
    picture(gpu, &request, &mut |_| {}).unwrap()
}

fn scenes() -> Vec<(String, Scene)> {
    let builtin = BUILTINS.iter().map(|b| (b.name.to_owned(), load_slice(b.name, b.glb).unwrap()));
    builtin.chain(common::small_scenes()).collect()
}

#[test]
fn gpu_pictures_equal_the_twins() {
    let Some(gpu) = common::gpu() else { return };
    for (name, scene) in scenes() {
        for light in [(None, false), (Some(Indirect::Ao), true), (Some(Indirect::None), false)] {
            let [device, twin] = [Some(&*gpu), None].map(|gpu| render(gpu, &scene, Strategy::Direct, light));
            assert_eq!(device.film.differing_pixels(&twin.film), 0, "{name}, {light:?}");
            assert_eq!(device.rays, twin.rays, "{name}, {light:?}: rays by kind");
            let lit = device.film.colors().iter().filter(|c| c[0] + c[1] + c[2] > 0.0).count();
            assert!(lit > 67 * 45 / 20, "{name}, {light:?}: only {lit} pixels are not black");
        }
    }
}

#[test]
fn gpu_pictures_are_the_same_with_all_strategies() {
    let Some(gpu) = common::gpu() else { return };
    for (name, scene) in scenes() {
        let direct = render(None, &scene, Strategy::Direct, (None, false));
        for strategy in [Strategy::Persistent, Strategy::Migrate] {
            let [device, twin] = [Some(&*gpu), None].map(|gpu| render(gpu, &scene, strategy, (None, false)));
            assert_eq!(device.film.differing_pixels(&twin.film), 0, "{name}, {strategy:?}");
            assert_eq!(device.film.colors(), direct.film.colors(), "{name}, {strategy:?}");
            assert_eq!(device.rays, direct.rays, "{name}, {strategy:?}: rays by kind");
        }
    }
}

#[test]
fn gpu_ray_digests_equal_the_twins() {
    let Some(gpu) = common::gpu() else { return };
    for (name, scene) in scenes() {
        let bvh = common::bvh(&scene);
        let camera = select_camera(&scene, None).unwrap();
        let frame = settings(&bvh).frame(&camera);
        for verdict in verify_rays(&gpu, &bvh, &Tables::new(&scene), frame).unwrap() {
            assert_eq!(verdict.mismatches, 0, "{name}: {verdict:?}");
            assert!(verdict.cases > 0, "{name}: {verdict:?}");
        }
    }
}

/// A picture does not depend on how its pixels are grouped into batches: the twin's are half the device's.
#[test]
fn gpu_pictures_do_not_depend_on_batches() {
    let Some(gpu) = common::gpu() else { return };
    let scene = load_slice("cornell", BUILTINS[0].glb).unwrap();
    let bvh = common::bvh(&scene);
    let tables = Tables::new(&scene);
    let camera = select_camera(&scene, None).unwrap();
    let tracing = TracerOptions::default();
    let settings = Settings { width: 500, height: 300, spp: 1, ..settings(&bvh) };
    let features = Features::of(&scene, None);
    let request = Request { bvh: &bvh, tables: &tables, camera: &camera, settings, features, aovs: false, tracing };
    let [device, twin] = [Some(&*gpu), None].map(|gpu| picture(gpu, &request, &mut |_| {}).unwrap());
    assert_eq!(device.film.differing_pixels(&twin.film), 0);
}

/// Each tile stops by itself, on the device as on the twin, and its pixels are those of a uniform picture of as many
/// samples.
#[test]
fn gpu_pictures_with_a_noise_target_equal_the_twins() {
    let Some(gpu) = common::gpu() else { return };
    let mut adapted = 0;
    for (name, scene) in scenes() {
        let bvh = common::bvh(&scene);
        let tables = Tables::new(&scene);
        let camera = select_camera(&scene, None).unwrap();
        let features = Features::of(&scene, None);
        let render = |gpu, spp, noise_target| {
            let settings = Settings { spp, noise_target, width: 27, height: 13, ..settings(&bvh) };
            let tracing = TracerOptions::default();
            let request =
                Request { bvh: &bvh, tables: &tables, camera: &camera, settings, features, aovs: true, tracing };
            picture(gpu, &request, &mut |_| {}).unwrap()
        };
        let [device, twin] = [Some(&*gpu), None].map(|gpu| render(gpu, 40, Some(0.03)));
        assert_eq!(device.film.differing_pixels(&twin.film), 0, "{name}");
        assert_eq!((device.rays, device.sampling), (twin.rays, twin.sampling), "{name}");
        adapted += u32::from(twin.sampling.min < twin.sampling.max);
        let samples = twin.film.samples_of_pixels();
        assert_eq!(twin.rays[0], samples.iter().map(|&n| u64::from(n)).sum::<u64>(), "{name}");
        let uniform = render(None, twin.sampling.min, None);
        for (i, color) in uniform.film.colors().iter().enumerate().filter(|(i, _)| samples[*i] == twin.sampling.min) {
            // Sums of passes are rounded once more.
            let close = |(a, b): (&f32, &f32)| (a - b).abs() <= 1e-6 * a.abs();
            assert!(color.iter().zip(&twin.film.colors()[i]).all(close), "{name}, pixel {i}");
        }
    }
    assert!(adapted >= 3, "tiles stop at different times in {adapted} scenes");
}
