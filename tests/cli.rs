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
    for command in ["render", "info", "bench", "scene", "verify", "model", "occupancy", "paper", "diff", "stability"] {
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
        (&["--noise-target", "0"], "--noise-target 0"),
        (&["--noise-target", "-0.1"], "--noise-target -0.1"),
        (&["--noise-target", "NaN"], "--noise-target NaN"),
        (&["--noise-target", "1.5"], "--noise-target 1.5"),
        (&["--time-limit", "-1"], "--time-limit -1"),
        (&["--time-limit", "NaN"], "--time-limit NaN"),
        (&["--time-limit", "inf"], "--time-limit inf"),
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
    caribou(&["bench", "--kernels", "/nowhere"]).code(2).stderr(contains("no kernels in /nowhere"));
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
        &[&COLOR[..], &["Z", "primId", "steps", "migrations", "subtrees", "samples"], &vectors].concat(),
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
    let hurried = ["model", "--tolerance", "0.0001", "--time-limit", "0.000001"];
    caribou(&hurried).code(1).stdout(contains("95 % interval")).stderr(contains("time limit"));
    caribou(&["model", "--bvh", "a.bvh"]).code(2).stderr(contains("--ray-file"));
    caribou(&["model", "--bvh", "none.bvh", "--ray-file", "none.rays"]).code(2).stderr(contains("none.bvh"));
}

/// Two triangles below one node, 64 rays towards them: files of another program.
fn exchanged(folder: &Path) -> (String, String) {
    let f = f32::to_bits;
    let mut tree = vec![0x3148_5642, 1, 2, 0];
    tree.extend([0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0].map(f));
    tree.extend([!1u32, !(1 << 4 | 1), 0, 0]);
    for (prim, z) in [(0, 1.0), (1, 2.0)] {
        tree.extend([f(0.0), f(0.0), f(z), prim, f(1.0), f(0.0), f(0.0), 0, f(0.0), f(1.0), f(0.0), 0]);
    }
    let rays = (0..64u8).flat_map(|i| [f32::from(i) / 64.0, 0.2, 0.0, 0.0, 0.0, 0.0, 1.0, 1e30].map(f));
    let write = |name: &str, words: Vec<u32>| {
        let path = folder.join(name);
        std::fs::write(&path, words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>()).unwrap();
        text(&path)
    };
    (write("a.bvh", tree), write("a.rays", rays.collect()))
}

#[test]
fn exchanged_trees_are_modelled_under_every_strategy_and_sampled() {
    let folder = folder();
    let (tree, rays) = exchanged(folder.path());
    let model = ["model", "--bvh", &tree, "--ray-file", &rays, "--json", "-"];
    for more in [
        &["--strategy", "direct"][..],
        &["--strategy", "persistent"],
        &["--strategy", "migrate", "--partition", "level:1"],
        &["--strategy", "migrate", "--partition", "level:1", "--accounting", "paper"],
        &["--tolerance", "0.1"],
    ] {
        let json = caribou(&[&model[..], more].concat()).success();
        let json: serde_json::Value = serde_json::from_slice(&json.get_output().stdout).unwrap();
        assert_eq!(json["rays"].as_u64(), Some(64), "{more:?}");
        assert!(json["cycles"].as_u64() > Some(0), "{more:?}");
    }
    let mut empty = std::fs::read(&tree).unwrap();
    empty[16 + 48..][..4].copy_from_slice(&(!0u32).to_le_bytes());
    std::fs::write(&tree, empty).unwrap();
    caribou(&model).success();
    caribou(&[&model[..], &["--strategy", "migrate"]].concat())
        .code(2)
        .stderr(contains("node 0").and(contains("empty leaf")));
}

#[test]
fn occupancy_names_its_limiter_and_draws() {
    let folder = folder();
    let demand = ["occupancy", "--regs", "21", "--threads", "192"];
    for (name, begin) in [("a.svg", "<svg"), ("a.png", "\u{fffd}PNG"), ("a.CSV", "chart,series,x axis,x,y axis,y")] {
        let chart = folder.path().join(name);
        let drawn = caribou(&[&demand[..], &["-o", &text(&chart)]].concat());
        drawn.success().stdout(contains("7 blocks, 42 of 48 warps"));
        assert!(String::from_utf8_lossy(&std::fs::read(&chart).unwrap()).starts_with(begin), "{name}");
    }
    let rule = ["occupancy", "--regs", "42", "--threads", "192", "--shared", "3000", "--rule", "gpgpusim"];
    caribou(&rule).success().stdout(contains("3 blocks, 18 of 48 warps"));
    caribou(&["occupancy", "--regs", "33", "--threads", "1024"]).success().stdout(contains("the launch fails"));
    caribou(&[&demand[..], &["-o", "a.gif"]].concat()).code(2).stderr(contains(".svg"));
}

/// A small picture by the twin.
fn rendered(folder: &Path, name: &str, width: &str, options: &[&str]) -> String {
    let path = text(&folder.join(name));
    let size = ["--width", width, "--height", "30", "--twin", "-q", "-o", &path];
    caribou(&[&["render", "builtin:cornell"], &size[..], options].concat()).success();
    path
}

#[test]
fn pictures_are_compared() {
    let folder = folder();
    let a = rendered(folder.path(), "a.exr", "40", &["--aov", "all"]);
    let b = rendered(folder.path(), "b.exr", "40", &["--aov", "all", "--sky", "0.5"]);
    let [png, exr, json] = ["d.png", "d.exr", "d.json"].map(|name| text(&folder.path().join(name)));
    for metric in ["rmse", "flip", "max"] {
        let same = ["diff", &a, &a, "--metric", metric, "--fail-above", "0", "-o", &png];
        caribou(&same).success().stdout(contains("primId").and(contains("FLIP 0.000000")));
        caribou(&["diff", &a, &b, "--metric", metric, "--fail-above", "1e-9", "-o", &exr, "--json", &json])
            .code(1)
            .stderr(contains(metric));
    }
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    assert_eq!((&report["schema"], &report["value"]), (&"caribou-diff/1".into(), &report["total"]["max"]));
    let of = |name: &str| {
        let channels = report["channels"].as_array().unwrap();
        channels.iter().find(|channel| channel["channel"] == name).unwrap()["rmse"].as_f64().unwrap()
    };
    assert!(of("R") > 0.0 && of("Z") == 0.0, "the sky lights, it moves nothing");
    let difference = caribou::render::exr::read::read(exr.as_ref()).unwrap();
    let r = difference.floats("R").unwrap();
    let rmse = (r.iter().map(|&d| f64::from(d * d)).sum::<f64>() / r.len() as f64).sqrt();
    assert!((rmse - of("R")).abs() < 1e-6 && difference.floats("flip").is_some());
}

#[test]
fn pictures_that_cannot_be_compared_are_refused() {
    let folder = folder();
    let a = rendered(folder.path(), "a.exr", "40", &[]);
    let z = rendered(folder.path(), "z.exr", "40", &["--aov", "Z"]);
    let small = rendered(folder.path(), "small.exr", "20", &[]);
    let text_file = text(&folder.path().join("text.exr"));
    std::fs::write(&text_file, "no picture").unwrap();
    for (arguments, message) in [
        (&[a.as_str(), &small][..], "40 x 30 and 20 x 30"),
        (&[&a, &z], "second alone: Z"),
        (&[&a, &text_file], "text.exr"),
        (&[&a, "/nowhere.exr"], "/nowhere.exr"),
        (&[&a, &a, "--fail-above", "-1"], "--fail-above -1"),
        (&[&a, &a, "--fail-above", "NaN"], "--fail-above NaN"),
        (&[&a, &a, "-o", "d.gif"], ".png or .exr"),
        (&[&a, &a, "--channels", "X"], "it has B, G, R"),
        (&[&z, &z, "--channels", "Z", "--metric", "flip"], "R, G and B"),
    ] {
        caribou(&[&["diff"], arguments].concat()).code(2).stderr(contains(message));
    }
    caribou(&["diff", &a, &z, "--channels", "R,G,B", "--fail-above", "0"]).success();
}

const SMALL_BENCH: [&str; 8] = ["bench", "--twin", "--width", "32", "--height", "24", "--runs", "2"];

#[test]
fn a_bench_is_compared_with_its_baseline() {
    let folder = folder();
    let path = text(&folder.path().join("old.json"));
    let rays = ["--rays", "primary,ao"];
    caribou(&[&SMALL_BENCH[..], &rays, &["--json", &path]].concat()).success();
    let original: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let against = |change: &dyn Fn(&mut serde_json::Value), options: &[&str]| {
        let mut changed = original.clone();
        change(&mut changed);
        std::fs::write(&path, changed.to_string()).unwrap();
        caribou(&[&SMALL_BENCH[..], &["--baseline", &path], options].concat())
    };
    // Rates that no machine reaches or falls below, so that no time decides.
    let rate = |mrays: f64| {
        move |report: &mut serde_json::Value| {
            let interval = serde_json::json!({"median": mrays, "low": mrays, "high": mrays});
            report["results"][0]["mrays_per_s"] = interval.clone();
            report["results"][1]["mrays_per_s"] = interval;
        }
    };
    against(&rate(1e-9), &rays).success().stdout(contains("2 of 2 rows changed").and(contains("faster")));
    against(&rate(1e9), &rays).code(1).stdout(contains("direct/ao: slower")).stderr(contains("2 became slower"));
    against(&rate(1e-9), &["--rays", "ao"]).success().stdout(contains("not run: direct/primary"));
    let visits = |report: &mut serde_json::Value| report["results"][1]["counters"]["node_visits"] = 7.into();
    against(&visits, &rays).code(1).stdout(contains("direct/ao: counters.node_visits was 7, is "));
    let digest = |report: &mut serde_json::Value| report["results"][0]["hits_digest"] = "0".into();
    against(&digest, &rays).code(1).stdout(contains("hits_digest"));
    let device = |report: &mut serde_json::Value| {
        rate(1e9)(report);
        report["machine"]["device"] = "another".into();
    };
    against(&device, &rays).success().stdout(contains("times were not compared"));
}

#[test]
fn baselines_of_other_runs_are_refused() {
    let folder = folder();
    let path = text(&folder.path().join("old.json"));
    caribou(&[&SMALL_BENCH[..], &["--rays", "primary", "--json", &path]].concat()).success();
    let original: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let refused = |change: &dyn Fn(&mut serde_json::Value), options: &[&str], message: &str| {
        let mut changed = original.clone();
        change(&mut changed);
        std::fs::write(&path, changed.to_string()).unwrap();
        let all = [&SMALL_BENCH[..], &["--baseline", &path], options].concat();
        caribou(&all).code(2).stderr(contains(message).and(contains("old.json")));
    };
    let primary = ["--rays", "primary"];
    refused(&|_| (), &["--rays", "ao"], "no row direct/ao");
    refused(&|r| r["schema"] = "caribou-bench/0".into(), &primary, "caribou-bench/0");
    refused(&|r| *r = serde_json::json!([]), &primary, "schema");
    refused(&|r| r["results"] = 1.into(), &primary, "results");
    refused(&|r| r["width"] = 33.into(), &primary, "width is 33 there and 32 here");
    refused(&|r| r["seed"] = 2.into(), &primary, "seed");
    refused(&|r| r["ao_radius"] = 2.into(), &primary, "ao_radius");
    refused(&|r| r["scene"]["name"] = "a/castle.glb".into(), &primary, "castle.glb");
    refused(&|r| r["scene"]["triangles"] = 1.into(), &primary, "scene.triangles");
    refused(&|r| r["results"][0]["mrays_per_s"] = "fast".into(), &primary, "direct/primary");
    std::fs::write(&path, "{").unwrap();
    caribou(&[&SMALL_BENCH[..], &["--baseline", &path]].concat()).code(2).stderr(contains("no JSON"));
    caribou(&["bench", "--twin", "--baseline", "/nowhere.json"]).code(2).stderr(contains("/nowhere.json"));
    for share in ["-1%", "NaN", "2", "x"] {
        let all = ["bench", "--twin", "--baseline", &path, "--fail-above", share];
        caribou(&all).code(2).stderr(contains("--fail-above"));
    }
}

#[test]
fn benches_are_exported_for_services() {
    let folder = folder();
    let [bencher, action] = ["bencher.json", "action.json"].map(|name| text(&folder.path().join(name)));
    let exports = ["--rays", "primary", "--export-bencher", &bencher, "--export-github-action", &action];
    caribou(&[&SMALL_BENCH[..], &exports].concat()).success();
    let read = |path: &str| serde_json::from_slice::<serde_json::Value>(&std::fs::read(path).unwrap()).unwrap();
    let row = read(&bencher)["builtin:cornell/direct/primary"].clone();
    let throughput = ["lower_value", "value", "upper_value"].map(|name| row["throughput"][name].as_f64().unwrap());
    assert!(throughput[0] > 0.0 && throughput.is_sorted(), "{throughput:?}");
    assert!(row["node-visits"]["value"].as_f64().unwrap() >= 1.0);
    let rows = read(&action);
    assert_eq!(rows.as_array().unwrap().len(), 3);
    for row in rows.as_array().unwrap() {
        assert!(row["value"].as_f64().unwrap() > 0.0 && row["name"].is_string() && row["unit"].is_string(), "{row}");
    }
}

#[test]
fn noise_targets_are_reached_or_the_picture_is_written_with_exit_code_1() {
    let folder = folder();
    let [exr, json] = ["a.exr", "a.json"].map(|name| text(&folder.path().join(name)));
    let size = ["render", "builtin:courtyard", "--twin", "--width", "40", "--height", "32", "--aov", "samples"];
    let files = ["-o", &exr, "--json", &json];
    let run = |options: &[&str]| caribou(&[&size[..], &files, options].concat());
    let report = || serde_json::from_slice::<serde_json::Value>(&std::fs::read(&json).unwrap()).unwrap();

    run(&["--noise-target", "0.03"]).success().stdout(contains("of 40 tiles reached 0.03").and(contains("less than")));
    let sampling = report()["sampling"].clone();
    assert!(sampling["worst_noise"].as_f64().unwrap() <= 0.0300001 && sampling["min"] == 16, "{sampling}");
    let image = caribou::render::exr::read::read(exr.as_ref()).unwrap();
    let samples = image.floats("samples").unwrap();
    let taken: f32 = samples.iter().sum();
    assert_eq!(report()["rays"]["primary"].as_f64(), Some(f64::from(taken)));
    assert!(samples.iter().any(|&n| n > 16.0));

    std::fs::remove_file(&exr).unwrap();
    run(&["--noise-target", "0.0001", "--spp", "20"]).code(1).stderr(contains("after 20 samples (--spp)"));
    assert_sound(exr.as_ref(), (40, 32), &[&COLOR[..], &["samples"]].concat());
    run(&["--noise-target", "0.0001", "--time-limit", "0"]).code(1).stderr(contains("after 0 s (--time-limit)"));
    run(&["--time-limit", "0"]).success().stdout(contains("1 spp"));
    assert_eq!(report()["rays"]["primary"], 40 * 32);
}

#[test]
fn quantised_nodes_are_for_strategy_direct() {
    let bench = ["bench", "builtin:cornell", "--twin", "--width", "16", "--height", "16", "--runs", "1"];
    let both = caribou(&[&bench[..], &["--rays", "primary", "--nodes", "full,quantised"]].concat());
    both.success().stdout(contains("full").and(contains("quantised")));
    for strategy in ["migrate", "persistent", "all"] {
        let refused = caribou(&[&bench[..], &["--nodes", "quantised", "--strategy", strategy]].concat());
        refused.code(2).stderr(contains("use --strategy direct or --nodes full"));
    }
    caribou(&["render", "--twin", "--nodes", "quantised", "--strategy", "migrate"])
        .code(2)
        .stderr(contains("--nodes full"));
}

#[test]
fn stability_makes_a_row_for_every_method() {
    let folder = folder();
    let out = folder.path().join("report");
    caribou(&["stability", "--quick", "-o", &text(&out)]).success().stdout(contains("stability.html"));
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(out.join("stability.json")).unwrap()).unwrap();
    let html = std::fs::read_to_string(out.join("stability.html")).unwrap();
    let methods = [
        "triangle test",
        "ray offset",
        "box test",
        "quantised nodes",
        "stack",
        "trail",
        "contention",
        "intervals",
        "cache mapping",
        "queues",
        "counters",
        "timers",
    ];
    for method in methods {
        assert!(json["rows"].as_array().unwrap().iter().any(|row| row["method"] == method), "{method}");
        assert!(html.contains(&format!("<td>{method}</td>")), "{method}");
    }
    assert!(html.contains("<svg") && !html.contains("src=") && out.join("stability.csv").exists());
    let file = text(&out.join("stability.json"));
    caribou(&["stability", "--quick", "-o", &file]).code(2).stderr(contains("cannot create"));
}
