//! `caribou study` from end to end, on the CPU twin, and what it refuses.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;

use assert_cmd::Command;
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;
use serde_json::Value;

fn study(arguments: &[&str]) -> assert_cmd::assert::Assert {
    Command::cargo_bin("caribou").unwrap().arg("study").args(arguments).assert()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

const FIELDS: [&str; 12] = [
    "chart",
    "quantity",
    "scene",
    "rays",
    "method",
    "parameter",
    "seconds",
    "value",
    "reference",
    "error",
    "interval",
    "on_front",
];

/// A point as the file should have it: numbers that are finite, intervals that hold their value.
fn assert_sound(point: &Value) {
    let fields: Vec<&str> = point.as_object().unwrap().keys().map(String::as_str).collect();
    assert_eq!(fields, FIELDS);
    let value = point["value"].as_f64().unwrap();
    assert!(value.is_finite() && point["seconds"].as_f64().unwrap() >= 0.0, "{point}");
    if let Some(ends) = point["interval"].as_array() {
        let [low, high] = [ends[0].as_f64().unwrap(), ends[1].as_f64().unwrap()];
        assert!(ends.len() == 2 && low <= value && value <= high, "{point}");
    }
    if let Some(reference) = point["reference"].as_f64() {
        let error = point["error"].as_f64().unwrap();
        let expected = if value == reference { 0.0 } else { (value / reference - 1.0).abs() };
        assert!((error - expected).abs() < 1e-9, "{point}");
    }
}

#[test]
fn a_quick_study_has_all_four_charts_with_fronts_and_exponents() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("new/study");
    study(&["builtin:cornell", "-o", text(&out), "--quick", "--width", "32", "--height", "24", "--twin"])
        .success()
        .stdout(contains("On the Pareto fronts").and(contains("study.html")));
    let report = report(&out);
    assert_eq!(report["schema"], "caribou-study/1");
    let points = report["points"].as_array().unwrap();
    points.iter().for_each(assert_sound);

    let of = |chart: &'static str| points.iter().filter(move |point| point["chart"] == chart);
    let has = |chart, field: &str, name: &str| of(chart).any(|point| point[field] == name);
    for fidelity in ["counters", "caches", "cycles"] {
        assert!(has("model", "method", fidelity), "{fidelity}");
    }
    for strategy in ["direct", "persistent", "migrate"] {
        assert!(has("image", "method", strategy) && has("traversal", "method", strategy), "{strategy}");
    }
    assert!(has("traversal", "method", "direct quantised"));
    for chart in ["model", "image", "traversal"] {
        assert!(of(chart).any(|point| point["on_front"] == true), "{chart}");
    }
    assert!(of("work").all(|point| point["on_front"] == false));
    for parameter in ["triangles", "rays", "sms"] {
        assert!(of("work").any(|point| point["parameter"]["name"] == parameter), "{parameter}");
        let exponents = report["exponents"].as_array().unwrap();
        let fitted = exponents.iter().find(|growth| growth["parameter"] == parameter).unwrap();
        assert!(fitted["exponent"].is_f64() && fitted["interval"].is_array(), "{fitted}");
    }
    let page = std::fs::read_to_string(out.join("study.html")).unwrap();
    assert!(page.matches("<svg").count() == 4 && !page.contains("http-equiv") && !page.contains("<script"));
    for chart in ["model", "image", "traversal", "work"] {
        assert!(std::fs::read(out.join(format!("{chart}.png"))).unwrap().starts_with(b"\x89PNG"), "{chart}");
        assert!(out.join(format!("{chart}.svg")).exists());
        let values = std::fs::read_to_string(out.join(format!("{chart}.csv"))).unwrap();
        assert!(values.lines().count() > 3 && values.starts_with("chart,series,"), "{chart}");
    }
    let all_on_the_front = |quantity: &str| {
        let front = of("model").filter(|point| point["quantity"] == quantity && point["on_front"] == true);
        front.filter(|point| point["method"] == "cycles").count()
    };
    // The reference has no error, so nothing beats it, in either kind of rays.
    assert_eq!((all_on_the_front("cycles"), all_on_the_front("l1_miss_rate")), (2, 2));
}

fn report(folder: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(folder.join("study.json")).unwrap()).unwrap()
}

#[test]
fn each_scene_is_judged_by_its_own_reference() {
    let folder = tempfile::tempdir().unwrap();
    let scenes = ["builtin:cornell", "builtin:courtyard", "-o", text(folder.path())];
    let small = ["--quick", "--width", "32", "--height", "24", "--twin", "--quiet", "--tolerance", "0.5"];
    study(&[&scenes[..], &small].concat()).success();
    let report = report(folder.path());
    let points: Vec<&Value> =
        report["points"].as_array().unwrap().iter().filter(|point| point["chart"] == "model").collect();
    let of_same = |point: &Value, other: &Value| ["quantity", "scene", "rays"].iter().all(|k| point[k] == other[k]);
    let mut references = Vec::new();
    for point in &points {
        let full = points.iter().find(|other| of_same(point, other) && other["method"] == "cycles").unwrap();
        assert_eq!(point["reference"], full["value"], "{point}");
        references.push(full["value"].as_f64().unwrap().to_bits());
    }
    references.sort_unstable();
    references.dedup();
    // Two scenes, two kinds of rays, cycles and miss rates, no two alike.
    assert_eq!(references.len(), 8);
    let methods: Vec<&str> =
        points.iter().filter(|point| of_same(point, points[0])).map(|p| p["method"].as_str().unwrap()).collect();
    assert_eq!(methods, ["sampled 0.5", "sampled 0.2", "sampled 0.1", "sampled 0.05", "counters", "caches", "cycles"]);
    let grown = report["points"].as_array().unwrap().iter().filter(|point| point["chart"] == "work");
    assert!(grown.filter(|point| point["quantity"] == "cycles").all(|point| point["method"] == "sampled 0.5"));
    assert_eq!(report["tolerance"], 0.5);
}

#[test]
fn what_there_is_no_time_for_is_left_out_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let scene = ["builtin:cornell", "-o", text(folder.path()), "--quick", "--width", "16", "--height", "12", "--twin"];
    study(&[&scene[..], &["--time-limit", "1e-9"]].concat())
        .success()
        .stdout(contains("Left out:").and(contains("cycles at 1 sms")))
        .stderr(contains("s  model of cornell").and(contains("s  work of procedural scenes")));
    let report = report(folder.path());
    let parts = report["parts"].as_array().unwrap();
    assert!(parts.len() == 5 && parts.iter().all(|part| part["seconds"].as_f64().unwrap() >= 0.0), "{parts:?}");
    assert!(
        report["left_out"].as_array().unwrap().iter().all(|left| left["why"].as_str().unwrap().contains("time limit"))
    );
    // What every chart needs is there.
    let has = |chart: &str| report["points"].as_array().unwrap().iter().any(|point| point["chart"] == chart);
    assert!(["model", "image", "traversal", "work"].into_iter().all(has));
}

#[test]
fn bad_input_is_refused_before_any_work_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| text(&folder.path().join(name)).to_owned();
    let write = |name: &str, content: &str| std::fs::write(path(name), content).unwrap();
    let run = r#"{"simulator": "3.2.2", "case": "CASE", "batch": "prim", "sms": 15, "l1_kib": 16, "rays": 1, "cycles": 1,
        "l1_miss_rate": 0.1, "l1_accesses": 1, "warp_instructions": 1, "simulator_cpu_s": null}"#;
    write("empty.json", "[]");
    write("other.json", r#"{"schema": "caribou-bench/1", "results": []}"#);
    write("case.json", &format!("[{run}]"));
    write("simulator.json", &format!("[{}]", run.replace("3.2.2", "9")));
    write("file", "");
    let (out, cases) = (path("out"), path(""));
    let reference = |name: &str| vec!["--reference".to_owned(), path(name), "--cases".to_owned(), cases.clone()];
    let options = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect::<Vec<String>>();
    let bad: Vec<(Vec<String>, &str)> = vec![
        (options(&["--width", "0"]), "--width 0"),
        (options(&["--height", "0"]), "--height 0"),
        (options(&["--machine", "voodoo"]), "unknown machine"),
        (options(&["nowhere.glb"]), "nowhere.glb"),
        (options(&["builtin:kitchen"]), "known scenes"),
        (options(&["--quick", "--full"]), "cannot be used with"),
        (options(&["--reference", "a.json"]), "--cases"),
        (options(&["--tolerance", "0"]), "above 0 and at most 1"),
        (options(&["--tolerance", "-0.1"]), "above 0 and at most 1"),
        (options(&["--tolerance", "1.5"]), "above 0 and at most 1"),
        (options(&["--tolerance", "NaN"]), "above 0 and at most 1"),
        (options(&["--time-limit", "0"]), "seconds above 0"),
        (options(&["--full", "--time-limit", "5"]), "cannot be used with"),
        (reference("missing.json"), "cannot read"),
        (reference("empty.json"), "there are none"),
        (reference("other.json"), "runs"),
        (reference("case.json"), "CASE.bvh is not there"),
        (reference("simulator.json"), "simulator 9"),
    ];
    for (arguments, reason) in bad {
        let mut arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        arguments.extend(["--twin", "-o", &out]);
        study(&arguments).code(2).stderr(contains(reason));
        assert!(!Path::new(&out).join("study.json").exists(), "{arguments:?}");
    }
    study(&["--twin", "-o", &path("file")]).code(2).stderr(contains("cannot create"));
    study(&["--twin", "-o", &path("file/below")]).code(2).stderr(contains("cannot create"));
    study(&["--twin"]).code(2).stderr(contains("--output"));
}
