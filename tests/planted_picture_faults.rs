//! Faults planted in the kernels of pictures and of quantised nodes show: as another picture, other counts of rays,
//! another noise, other hits or counters than the twin's.
#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod common;

use caribou::render::features::{Features, Indirect};
use caribou::render::picture::{Picture, Request, picture};
use caribou::render::settings::Settings;
use caribou::scene::tables::Tables;
use caribou::scene::{Scene, builtin, load_slice, procedural, select_camera};
use caribou::trace::{NodeFormat, Query, TracerOptions, TwinTracer};
use caribou::vulkan::Gpu;
use common::faults::{Fault, gpu_with_fault};

/// Kernels that a picture passes through, besides those that trace.
const STAGES: [&str; 6] = ["generate", "light", "gather", "shade", "resolve", "aov"];

/// A room with lamps, a mirror and glass; its width is no multiple of a tile's.
fn rendered(gpu: Option<&Gpu>, indirect: Indirect) -> Picture {
    let scene: Scene = load_slice("gallery", builtin::builtin("gallery").unwrap()).unwrap();
    let bvh = common::bvh(&scene);
    let tables = Tables::new(&scene);
    let camera = select_camera(&scene, None).unwrap();
    let features = Features::of(&scene, Some(indirect));
    let ao_radius = Settings::default_ao_radius(bvh.bounds);
    let settings = Settings { width: 67, height: 45, spp: 3, max_depth: 6, ao_radius, ..Settings::default() };
    let tracing = TracerOptions::default();
    let request = Request { bvh: &bvh, tables: &tables, camera: &camera, settings, features, aovs: true, tracing };
    picture(gpu, &request, &mut |_| {}).unwrap()
}

/// Whether the fault shows; nothing without a device.
fn shows(fault: Fault, indirect: Indirect, twin: &Picture) -> Option<bool> {
    let (gpu, _folder) = gpu_with_fault(&STAGES, fault)?;
    let device = rendered(Some(&gpu), indirect);
    Some(
        device.film.differing_pixels(&twin.film) > 0
            || device.rays != twin.rays
            || device.sampling.noise != twin.sampling.noise,
    )
}

fn check(indirect: Indirect, faults: &[(&str, &'static str, &'static str, &'static str)]) {
    let twin = rendered(None, indirect);
    let no_fault = Fault { file: "resolve.comp", original: "sums[i] = sum;", planted: "sums[i] = sum; " };
    assert_ne!(shows(no_fault, indirect, &twin), Some(true), "what is no fault shows");
    for &(what, file, original, planted) in faults {
        assert_ne!(shows(Fault { file, original, planted }, indirect, &twin), Some(false), "{what} does not show");
    }
}

#[test]
fn planted_faults_in_camera_rays_and_sums_show() {
    let (generate, resolve) = ("generate.comp", "resolve.comp");
    check(
        Indirect::Diffuse,
        &[
            ("jitter of another axis", generate, "float(pixel.y) + jitter.y", "float(pixel.y) + jitter.x"),
            ("no jitter", generate, "push.sample_index == 0u", "push.sample_index < 2u"),
            ("rays beside the picture", generate, "ray.t_max = -1.0;", "ray.t_max = FAR_AWAY;"),
            ("a lost sample", resolve, "sums[i] = sum;", "if (before != 1u) sums[i] = sum;"),
            ("deviations from one mean", resolve, "from_old * from_new;", "from_old * from_old;"),
            ("tiles of another width", "include/tiles.glsl", "tile / tiles * TILE_HEIGHT", "tile / tiles * TILE_WIDTH"),
        ],
    );
}

#[test]
fn planted_faults_in_shading_show() {
    let (light, shade) = ("light.comp", "shade.comp");
    check(
        Indirect::Diffuse,
        &[
            ("light without distance", light, "* exact_rcp(distance2);", "* 1.0;"),
            ("shadows of what is behind the lamp", light, "useful ? a.distance", "useful ? FAR_AWAY"),
            ("light through walls", "gather.comp", "|| shadow_hits[i].prim != NO_HIT", ""),
            ("mirrors without tint", shade, "path.throughput = path.throughput * tint;", ""),
            ("glass tinted twice", shade, "if (!solid || s.front) path", "path"),
            ("a second diffuse bounce", shade, "path.state |= PATH_BOUNCED;", ""),
            ("the same choice at every bounce", shade, "path.state += 1u;", "path.state |= 1u;"),
            (
                "Z along the ray",
                "aov.comp",
                "pixel.z = dot3(pixel.position - frame.camera_origin, frame.camera_forward);",
                "pixel.z = hit.t;",
            ),
        ],
    );
}

#[test]
fn planted_faults_in_ambient_occlusion_show() {
    check(
        Indirect::Ao,
        &[
            ("unlimited rays", "light.comp", "-1.0 : frame.ao_radius", "-1.0 : FAR_AWAY"),
            ("the same rays for all samples", "light.comp", "dimension, push.sample_index", "dimension, 0u"),
        ],
    );
}

#[test]
fn planted_faults_in_quantised_nodes_show() {
    let scene = procedural::build("forest", 4_000, 1).unwrap();
    let (bvh, rays) = (common::bvh(&scene), common::rays_around(&scene, 2_000));
    let options = TracerOptions { nodes: NodeFormat::Quantised, ..TracerOptions::default() };
    let twin = TwinTracer::new(&bvh, &options).unwrap().trace(Query::Closest, &rays).unwrap();
    let shows = |original, planted| {
        let fault = Fault { file: "include/quantised.glsl", original, planted };
        let (gpu, _folder) = gpu_with_fault(&["direct_quantised", "direct_quantised_cpu"], fault)?;
        let (hits, counters) = common::trace_on(&gpu, &bvh, &rays, Query::Closest, options);
        Some(hits != twin.hits || counters != twin.counters)
    };
    assert_ne!(shows("+ origin;", "+ origin; "), Some(true), "what is no fault shows");
    let faults = [
        ("steps of another axis", "node.exponents >> 16), decode", "node.exponents >> 8), decode"),
        ("planes of half a grid", "bytes >> 24) & 255u", "bytes >> 24) & 127u"),
        ("a leaf's neighbour", "(inner0 ? 0u : kind0)", "0u"),
    ];
    for (what, original, planted) in faults {
        assert_ne!(shows(original, planted), Some(false), "{what} does not show");
    }
}
