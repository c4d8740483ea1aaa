//! The program as its users meet it: exit codes, messages, files.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::path::Path;

use assert_cmd::Command;
use common::exr::assert_sound;
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;

const COLOR: [&str; 3] = ["R", "G", "B"];

fn caribou(arguments: &[&str]) -> assert_cmd::assert::Assert {
    Command::cargo_bin("caribou").unwrap().args(arguments).assert()
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

fn text(path: &Path) -> String {
    path.to_str().unwrap().to_owned()
}

#[test]
fn help_and_version_are_no_errors() {
    caribou(&["--help"]).success().stdout(contains("Exit codes"));
    caribou(&["--version"]).success().stdout(contains(env!("CARGO_PKG_VERSION")));
    for command in ["render", "info", "bench", "scene", "verify", "model", "occupancy"] {
        caribou(&[command, "--help"]).success();
    }
}

#[test]
fn bad_usage_is_exit_code_2_and_writes_nothing() {
    let folder = folder();
    let out = text(&folder.path().join("out.exr"));
    let cases: &[(&[&str], &str)] = &[
        (&["--width", "0"], "--width 0"),
        (&["--height", "0"], "--height 0"),
        (&["--spp", "0"], "--spp 0"),
        (&["--width", "60000", "--height", "60000", "--aov", "all"], "MiB"),
        (&["--width", "65535", "--height", "65535"], "pixels"),
        (&["--width", "70000"], "--width 70000"),
        (&["--camera", "nobody"], "nobody"),
        (&["--camera", "99"], "99"),
        (&["--aov", "depth"], "depth"),
        (&["--max-depth", "65"], "--max-depth"),
        (&["--preview-aov", "steps"], "--preview"),
        (&["--exposure", "NaN"], "--exposure"),
        (&["--sky", "-1"], "--sky"),
        (&["--ao-radius", "inf"], "--ao-radius"),
        (&["--preview", "/nowhere/at/all.png"], "/nowhere/at"),
        (&["--nonsense"], "--nonsense"),
        (&["--strategy", "all"], "--strategy"),
        (&["--partition", "level:99"], "from 0 to 63"),
        (&["--partition", "bytes:0"], "from 384 to 1GiB"),
        (&["--partition", "bytes:1TB"], "from 384 to 1GiB"),
        (&["--partition", "byte:64KiB"], "bytes:64KiB"),
        (&["--sms", "0"], "from 1 to 1024"),
        (&["--sms", "10000"], "from 1 to 1024"),
        (&["--warps-per-sm", "65"], "from 1 to 64"),
        (&["--owners", "nobody"], "scattered"),
    ];
    for (arguments, message) in cases {
        let all = [&["render", "builtin:cornell", "--twin", "-o", &out], *arguments].concat();
        caribou(&all).code(2).stderr(contains(*message));
        assert!(!Path::new(&out).exists(), "{arguments:?}");
    }
    caribou(&["render", "builtin:nothing", "--twin", "-o", &out]).code(2).stderr(contains("cornell"));
    caribou(&["render", "missing.glb", "--twin", "-o", &out]).code(2).stderr(contains("missing.glb"));
    caribou(&["render", "--twin", "-o", "/nowhere/at/all.exr"]).code(2).stderr(contains("/nowhere/at"));
    caribou(&["scene", "room", "--triangles", "10", "-o", &text(&folder.path().join("a.glb"))]).code(2);
    caribou(&["scene", "castle", "-o", &text(&folder.path().join("a.glb"))]).code(2).stderr(contains("forest"));
    caribou(&["scene", "room", "-o", &text(&folder.path().join("a.obj"))]).code(2).stderr(contains(".glb"));
    caribou(&["bench", "--twin", "--runs", "0"]).code(2).stderr(contains("--runs"));
    caribou(&["bench", "--twin", "--dump-rays", &out]).code(2).stderr(contains("--rays"));
    caribou(&["bench", "--twin", "--step-trace", &out]).code(2).stderr(contains("--rays"));
    caribou(&["bench", "--twin", "--trace-rays", "5"]).code(2).stderr(contains("--step-trace"));
    caribou(&["bench", "--kernels", "/nowhere"]).code(2).stderr(contains("/nowhere"));
    caribou(&["info", "builtin:cornell", "--partition", "level:99"]).code(2).stderr(contains("from 0 to 63"));
    caribou(&["info", "builtin:cornell", "--partition", "level:2", "--sms", "0"]).code(2).stderr(contains("1 to 1024"));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn migration_is_reported() {
    let folder = folder();
    let steps = text(&folder.path().join("steps.bin"));
    caribou(&["info", "builtin:gallery", "--partition", "bytes:16KiB"]).success().stdout(contains("expected visits"));
    let bench = ["bench", "builtin:gallery", "--twin", "--width", "64", "--height", "48", "--runs", "1"];
    let migrate = ["--strategy", "all", "--partition", "sah:4KiB", "--sms", "4"];
    let table = [&bench[..], &migrate, &["--rays", "primary,ao"]].concat();
    caribou(&table).success().stdout(contains("busiest SM").and(contains("persistent")));
    let trace = ["--strategy", "migrate", "--rays", "diffuse", "--step-trace", &steps, "--trace-rays", "100"];
    caribou(&[&bench[..], &trace].concat()).success();
    assert_eq!(caribou::trace::StepSample::read(steps.as_ref()).unwrap().rays.len(), 100);
}

#[test]
fn the_twin_renders_every_channel() {
    renders_every_channel(&["--twin"]);
}

#[test]
fn gpu_renders_every_channel() {
    if common::gpu().is_some() {
        renders_every_channel(&[]);
    }
}

fn renders_every_channel(device: &[&str]) {
    let folder = folder();
    let [exr, png, json] = ["a.exr", "a.png", "a.json"].map(|name| text(&folder.path().join(name)));
    let files = ["-o", &exr, "--preview", &png, "--preview-aov", "steps", "--json", &json];
    let size = ["--width", "80", "--height", "60", "--spp", "2", "--aov", "all"];
    caribou(&[&["render", "builtin:gallery"], device, &size, &files].concat())
        .success()
        .stdout(contains("Mrays/s").and(contains("device")));
    let vectors = ["N.X", "N.Y", "N.Z", "albedo.R", "albedo.G", "albedo.B", "P.X", "P.Y", "P.Z"];
    assert_sound(
        exr.as_ref(),
        (80, 60),
        &[&COLOR[..], &["Z", "primId", "steps", "migrations", "subtrees"], &vectors].concat(),
    );
    assert!(Path::new(&png).exists());
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    assert_eq!(report["schema"], "caribou-render/1");
    assert_eq!(report["rays"]["primary"], 80 * 60 * 2);
}

#[test]
fn pictures_repeat_and_seeds_differ() {
    let folder = folder();
    let render = |name: &str, seed: &str| {
        let path = folder.path().join(name);
        let size = ["--width", "64", "--height", "48", "--spp", "2", "--depth", "float", "-q"];
        caribou(&[&["render", "--twin", "--seed", seed, "-o", &text(&path)][..], &size].concat()).success().stdout("");
        assert_sound(&path, (64, 48), &COLOR);
        let image = exr::prelude::read_first_rgba_layer_from_file(
            &path,
            |size, _| vec![[0f32; 3]; size.area()],
            |pixels, at, (r, g, b, _): (f32, f32, f32, f32)| pixels[at.y() * 64 + at.x()] = [r, g, b],
        );
        image.unwrap().layer_data.channel_data.pixels
    };
    let first = render("a.exr", "1");
    assert_eq!(first, render("b.exr", "1"));
    assert_ne!(first, render("c.exr", "2"));
}

#[test]
fn the_bench_reports_its_schema() {
    let folder = folder();
    let json = folder.path().join("bench.json");
    caribou(&["bench", "--twin", "--width", "64", "--height", "48", "--runs", "2", "--json", &text(&json)])
        .success()
        .stdout(contains("diffuse"));
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    assert_eq!(report["schema"], "caribou-bench/1");
    let results = report["results"].as_array().unwrap();
    assert_eq!(results.len(), 4);
    for result in results {
        assert_eq!(result["strategy"], "direct");
        assert_eq!(result["seconds"].as_array().unwrap().len(), 2);
        assert_eq!(result["hits_digest"].as_str().unwrap().len(), 16);
        assert!(result["counters"]["node_visits"].as_u64().unwrap() >= result["ray_count"].as_u64().unwrap());
        assert!(result["mrays_per_s"]["median"].as_f64().unwrap() > 0.0);
    }
}

#[test]
fn info_tells_of_a_scene_without_a_device() {
    let mut command = Command::cargo_bin("caribou").unwrap();
    command.env("VK_DRIVER_FILES", "/nowhere.json").env("VK_ICD_FILENAMES", "/nowhere.json");
    command.args(["info", "builtin:cornell"]).assert().success().stdout(contains("SAH cost").and(contains("glass")));
}

#[test]
fn procedural_scenes_can_be_written_and_rendered() {
    let folder = folder();
    let (glb, exr) = (text(&folder.path().join("needles.glb")), text(&folder.path().join("needles.exr")));
    caribou(&["scene", "needles", "--triangles", "1000", "-o", &glb]).success().stdout(contains("1000 triangles"));
    caribou(&["render", &glb, "--twin", "--width", "40", "--height", "30", "-o", &exr]).success();
    assert_sound(exr.as_ref(), (40, 30), &COLOR);
}

#[test]
fn empty_scenes_are_rendered() {
    let folder = folder();
    let (gltf, exr) = (folder.path().join("empty.gltf"), folder.path().join("empty.exr"));
    std::fs::write(&gltf, r#"{"asset": {"version": "2.0"}, "scenes": [{}], "scene": 0}"#).unwrap();
    caribou(&["render", &text(&gltf), "--twin", "--width", "8", "--height", "8", "-o", &text(&exr)])
        .success()
        .stdout(contains("0 triangles"));
    assert_sound(&exr, (8, 8), &COLOR);
}

#[test]
fn the_model_prints_a_table_or_json_and_refuses_what_cannot_be() {
    let small = ["model", "builtin:cornell", "--width", "16", "--height", "8"];
    caribou(&small).success().stdout(contains("cycles").and(contains("limited by registers")));
    let json = caribou(&[&small[..], &["--json", "-", "--fidelity", "caches", "--set", "sms=2"]].concat()).success();
    let json: serde_json::Value = serde_json::from_slice(&json.get_output().stdout).unwrap();
    assert_eq!((json["rays"].as_u64(), json["occupancy"]["warps"].as_u64()), (Some(128), Some(20)));
    for (arguments, message) in [
        (&["--machine", "gtx9"][..], "gpgpusim-3.2.2"),
        (&["--kernel", "none"], "while-while"),
        (&["--set", "l1.ways=3"], "l1.ways"),
        (&["--set", "l1.wais=4"], "l1.ways"),
        (&["--set", "kernel.registers=64"], "registers"),
        (&["--set", "sms"], "key=value"),
        (&["--bvh", "a.bvh"], "cannot be used with"),
    ] {
        caribou(&[&small[..], arguments].concat()).code(2).stderr(contains(message));
    }
    for tolerance in ["0", "-0.02", "1.5", "NaN"] {
        caribou(&[&small[..], &["--tolerance", tolerance]].concat()).code(2).stderr(contains("--tolerance"));
    }
    for (option, value) in [("--strategy", "migrate"), ("--strategy", "persistent"), ("--fidelity", "cycles")] {
        caribou(&[&small[..], &["--tolerance", "0.1", option, value]].concat()).code(2).stderr(contains("sampled"));
    }
    caribou(&[&small[..], &["--tolerance", "0.1"]].concat()).code(0).stdout(contains("95 % interval"));
    let hurried = ["model", "--set", "sms=1", "--tolerance", "0.0001", "--time-limit", "0.000001"];
    caribou(&hurried).code(1).stdout(contains("95 % interval")).stderr(contains("time limit"));
    caribou(&["model", "--bvh", "a.bvh"]).code(2).stderr(contains("--ray-file"));
    caribou(&["model", "--bvh", "none.bvh", "--ray-file", "none.rays"]).code(2).stderr(contains("none.bvh"));
}

#[test]
fn occupancy_names_its_limiter_and_draws() {
    let folder = folder();
    let chart = text(&folder.path().join("a.svg"));
    let demand = ["occupancy", "--regs", "21", "--threads", "192"];
    caribou(&[&demand[..], &["-o", &chart]].concat()).success().stdout(contains("7 blocks, 42 of 48 warps"));
    assert!(std::fs::read_to_string(&chart).unwrap().contains("registers a thread"));
    let rule = ["occupancy", "--regs", "42", "--threads", "192", "--shared", "3000", "--rule", "gpgpusim"];
    caribou(&rule).success().stdout(contains("3 blocks, 18 of 48 warps"));
    caribou(&["occupancy", "--regs", "33", "--threads", "1024"]).success().stdout(contains("the launch fails"));
    caribou(&[&demand[..], &["-o", "a.gif"]].concat()).code(2).stderr(contains(".svg"));
}
