//! `caribou info`: devices, and what a scene holds.

use std::fmt::Write;

use clap::Args;
use serde::Serialize;

use super::input::{Ownership, SceneArguments};
use super::output;
use crate::Result;
use crate::bvh::partition::PartitionStatistics;
use crate::bvh::{Bvh, Partition, Policy};
use crate::render::features::Features;
use crate::report::scene::SceneSummary;
use crate::vulkan::specialised::{self, Size};
use crate::vulkan::{DeviceInfo, Gpu, GpuOptions, Probe, list_devices};

/// Show Vulkan devices and, of a scene, what it holds and its BVH
#[derive(Args)]
pub struct Info {
    /// A .glb or .gltf file, or builtin:NAME
    scene: Option<String>,
    /// Time spent on the BVH: obvhs's build presets; from medium on large triangles are cut into pieces
    #[arg(long, value_enum, default_value_t)]
    bvh_quality: crate::bvh::Quality,
    /// Also cut the tree and show the subtrees: level:K, bytes:N or sah:N, such as bytes:64KiB
    #[arg(long, value_name = "POLICY", requires = "scene")]
    partition: Option<Policy>,
    #[command(flatten)]
    ownership: Ownership,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Longest bar of a histogram, in characters.
const BAR: usize = 40;

/// Everything that is known.
#[derive(Serialize)]
struct Report {
    schema: &'static str,
    devices: Vec<Device>,
    #[serde(skip_serializing_if = "Option::is_none")]
    devices_problem: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    scene: Option<SceneSummary>,
    #[serde(skip_serializing_if = "Option::is_none")]
    features: Option<Features>,
    /// Kernels that depend on the features, without what the scene does not need.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    kernels: Vec<Size>,
    #[serde(skip_serializing_if = "Option::is_none")]
    partition: Option<PartitionStatistics>,
}

/// A device and what was found by running kernels on it.
#[derive(Serialize)]
struct Device {
    #[serde(flatten)]
    info: DeviceInfo,
    probe: Option<Probe>,
    /// Hits equal those of every other such device bit for bit.
    bit_identical: Option<bool>,
}

impl Info {
    /// Gathers and prints.
    pub fn run(&self) -> Result<()> {
        let mut report = Report {
            schema: "caribou-info/1",
            devices: Vec::new(),
            devices_problem: None,
            scene: None,
            features: None,
            kernels: Vec::new(),
            partition: None,
        };
        match list_devices() {
            Ok(devices) => report.devices = devices.into_iter().map(probed).collect(),
            // A scene can be looked at without any device.
            Err(error) if self.scene.is_some() => report.devices_problem = Some(error.to_string()),
            Err(error) => return Err(error),
        }
        if let Some(name) = &self.scene {
            let scene = SceneArguments::named(name).load()?;
            let bvh = Bvh::build(&scene.positions, self.bvh_quality)?;
            report.scene = Some(SceneSummary::new(&scene, &bvh));
            let features = Features::of(&scene, None);
            report.kernels = specialised::sizes(&features.specialization());
            report.features = Some(features);
            if let Some(policy) = self.partition {
                let partition = Partition::new(&bvh, policy, self.ownership.owners, self.ownership.sms)?;
                report.partition = Some(PartitionStatistics::of(&partition));
            }
        }
        if self.json { output::print_json(&report) } else { output::print(&text(&report)) }
    }
}

fn probed(info: DeviceInfo) -> Device {
    let options = GpuOptions { device: Some(info.index.to_string()), ..GpuOptions::default() };
    let probe = Gpu::open(&options).ok().map(|gpu| *gpu.probe());
    Device { info, bit_identical: probe.map(|probe| probe.bit_identical()), probe }
}

fn text(report: &Report) -> String {
    let mut text = String::new();
    for device in &report.devices {
        device_text(&mut text, device);
    }
    if let Some(problem) = &report.devices_problem {
        let _ = writeln!(text, "no device: {problem}");
    }
    if let (Some(scene), Some(features)) = (&report.scene, &report.features) {
        scene_text(&mut text, scene, features, &report.kernels);
    }
    if let Some(partition) = &report.partition {
        partition_text(&mut text, partition);
    }
    text
}

fn partition_text(text: &mut String, p: &PartitionStatistics) {
    let _ = writeln!(text, "partition  {} among {} SMs", p.policy, p.sms);
    let _ = writeln!(text, "  top tree          {} nodes, {} bytes, {} levels", p.top_nodes, p.top_bytes, p.top_depth);
    let _ = writeln!(
        text,
        "  expected visits   {:.2} top nodes and {:.2} subtrees by a ray that meets the scene's box and hits nothing",
        p.expected_top_visits, p.expected_subtree_visits
    );
    let _ = writeln!(text, "  expected work     the busiest SM has {:.2} times the mean", p.imbalance);
    let _ = writeln!(text, "  subtrees          {}", p.subtrees);
    for (what, histogram) in [("bytes", &p.bytes), ("triangles", &p.triangles), ("levels", &p.depth)] {
        let _ = writeln!(text, "  {what:<17} {} to {}, mean {:.1}", histogram.min, histogram.max, histogram.mean);
        let most = histogram.ranges.iter().map(|&(_, count)| count).max().unwrap_or(1);
        for &(low, count) in &histogram.ranges {
            let high = if low == 0 { 0 } else { 2 * low - 1 };
            let bar = "#".repeat((BAR * count).div_ceil(most));
            let _ = writeln!(text, "    {low:>9} to {high:<9} {count:>8} {bar}");
        }
    }
}

fn device_text(text: &mut String, device: &Device) {
    let info = &device.info;
    let _ = writeln!(text, "device {}  {}", info.index, info.name);
    let _ = writeln!(text, "  driver            {} {}, Vulkan {}", info.driver, info.driver_version, info.api_version);
    let _ = writeln!(text, "  subgroup          {} lanes", info.subgroup_size);
    let counters = [
        (info.driver_counters.pipeline_statistics, "invocations of kernels"),
        (info.driver_counters.performance_query, "hardware counters (not read)"),
    ];
    let counters: Vec<&str> = counters.into_iter().filter_map(|(has, name)| has.then_some(name)).collect();
    if !counters.is_empty() {
        let _ = writeln!(text, "  driver counts     {}", counters.join(", "));
    }
    let limits = &info.limits;
    let _ = writeln!(
        text,
        "  limits            {} MiB a binding, {} workgroups of {}, {} KiB shared",
        limits.storage_buffer_range >> 20,
        limits.groups,
        limits.group_invocations,
        limits.shared_memory >> 10
    );
    let heaps: Vec<String> = info.heaps.iter().map(|heap| format!("{} MiB", heap.bytes >> 20)).collect();
    let _ = writeln!(text, "  memory            {}", heaps.join(", "));
    if let Some(reason) = &info.unusable {
        let _ = writeln!(text, "  unusable          {reason}");
    }
    if let Some(probe) = &device.probe {
        let limit = probe.loop_limit.map_or("none found".to_owned(), |n| format!("{n} iterations, then silence"));
        let _ = writeln!(text, "  loop limit        {limit}");
        let exact = |is: bool, ulp: u32| if is { "exact".to_owned() } else { format!("off by up to {ulp} ulp") };
        let _ = writeln!(
            text,
            "  arithmetic        division {}, sqrt {}, fma {}, denormals {}",
            exact(probe.exact_division, probe.division_ulp),
            exact(probe.exact_sqrt, probe.sqrt_ulp),
            if probe.fma_fused { "fused" } else { "not fused" },
            if probe.denormals_preserved { "kept" } else { "flushed" }
        );
        let same = if probe.bit_identical() { "equal those of the CPU bit for bit" } else { "may differ in last bits" };
        let _ = writeln!(text, "  hits              {same}");
    }
}

fn scene_text(text: &mut String, scene: &SceneSummary, features: &Features, kernels: &[Size]) {
    let _ = writeln!(text, "scene  {}", scene.name);
    let _ = writeln!(
        text,
        "  triangles         {} ({} degenerate), {} vertices, {} mesh instances",
        scene.triangles, scene.loading.degenerate_triangles, scene.loading.vertices, scene.loading.mesh_instances
    );
    if let Some([low, high]) = scene.bounds {
        let _ = writeln!(text, "  bounds            {low:?} to {high:?}");
    }
    let _ =
        writeln!(text, "  materials         {}, {} textures, {} lights", scene.materials, scene.textures, scene.lights);
    for (index, camera) in scene.cameras.iter().enumerate() {
        let name = camera.name.as_deref().unwrap_or("(no name)");
        let _ = writeln!(text, "  camera {index:<10} {name}, {}", camera.projection);
    }
    let (used, unused) = features.names();
    let _ = writeln!(text, "  kernels with      {}", or_none(&used.join(", ")));
    let _ = writeln!(text, "  compiled out      {}", or_none(&unused.join(", ")));
    let size = |size: &Size| format!("{} {} of {}", size.kernel, size.instructions, size.of);
    let sizes = kernels.iter().map(size).collect::<Vec<_>>().join(", ");
    let _ = writeln!(text, "  SPIR-V left       {sizes} instructions");
    for warning in &scene.loading.warnings {
        let _ = writeln!(text, "  warning           {warning}");
    }
    let bvh = &scene.bvh;
    let _ = writeln!(text, "BVH    nodes and leaves in the terms of Zhu and Deng 2013, Table I");
    let _ = writeln!(text, "  nodes             {}, leaves {}, depth {}", bvh.nodes, bvh.leaves, bvh.depth);
    let _ = writeln!(text, "  triangles a leaf  {:.2}, by count {:?}", bvh.triangles_per_leaf, bvh.leaf_histogram);
    let _ = writeln!(text, "  in all leaves     {} triangles, those cut once a leaf", bvh.references);
    let _ = writeln!(text, "  SAH cost          {:.2}", bvh.sah_cost);
    let _ = writeln!(text, "  bytes             {} nodes, {} triangles", bvh.node_bytes, bvh.triangle_bytes);
}

fn or_none(text: &str) -> &str {
    if text.is_empty() { "none" } else { text }
}
