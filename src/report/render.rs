//! What a picture took: for the summary, the JSON file and the EXR header.

use std::collections::BTreeMap;
use std::fmt::Write;

use serde::Serialize;

use super::head::Head;
use super::tracing::Tracing;
use crate::render::features::Features;
use crate::render::noise::SamplingSummary;
use crate::render::stages::{KIND_NAMES, RayCounts};
use crate::{Error, Result};

/// Schema `caribou-render/1`.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// What it is of.
    #[serde(flatten)]
    pub head: Head,
    /// Samples a pixel; the most allowed with a noise target or a time limit.
    pub spp: u32,
    /// Noise at which tiles are done.
    pub noise_target: Option<f32>,
    /// Seconds after which no further sample was begun.
    pub time_limit: Option<f64>,
    /// Samples taken and noise left.
    pub sampling: SamplingSummary,
    /// Most bounces.
    pub max_depth: u32,
    /// Seed of the random numbers.
    pub seed: u32,
    /// How rays were traced.
    pub tracing: Tracing,
    /// Parts of the kernels that the scene needs.
    pub features: Features,
    /// Parts that were compiled out.
    pub compiled_out: Vec<&'static str>,
    /// Rays traced by kind.
    pub rays: BTreeMap<&'static str, u64>,
    /// Seconds by step of the whole job.
    pub seconds: BTreeMap<String, f64>,
    /// Seconds by stage of rendering, on the device's clock where it has one.
    pub stage_seconds: BTreeMap<String, f64>,
    /// Million rays of all kinds a second of rendering.
    pub mrays_per_s: f64,
}

/// Rays by the names of their kinds.
pub fn named(counts: &RayCounts) -> BTreeMap<&'static str, u64> {
    KIND_NAMES.into_iter().zip(*counts).collect()
}

impl Report {
    /// The short text at the end of a run.
    pub fn summary(&self) -> String {
        let Head { machine, scene, width, height, .. } = &self.head;
        let bvh = &scene.bvh;
        let mut text = String::new();
        let _ = writeln!(text, "scene    {}: {} triangles, {} nodes", scene.name, bvh.triangles, bvh.nodes);
        if scene.loading.degenerate_triangles > 0 {
            let _ = writeln!(text, "         {} degenerate triangles", scene.loading.degenerate_triangles);
        }
        let _ = writeln!(text, "picture  {width} x {height}, {}", self.samples());
        text += &self.noise();
        let _ = writeln!(text, "device   {}", machine.device);
        let kinds = KIND_NAMES.iter().filter(|kind| self.rays[*kind] > 0);
        let rays: Vec<String> = kinds.map(|kind| format!("{} {kind}", self.rays[kind])).collect();
        let _ = writeln!(text, "rays     {}", rays.join(", "));
        for (label, seconds) in [("time    ", &self.seconds), ("stages  ", &self.stage_seconds)] {
            let parts: Vec<String> = seconds.iter().map(|(step, s)| format!("{step} {s:.3} s")).collect();
            let _ = writeln!(text, "{label} {}", parts.join(", "));
        }
        let _ = writeln!(text, "speed    {:.3} Mrays/s", self.mrays_per_s);
        text
    }

    fn samples(&self) -> String {
        let SamplingSummary { mean, min, max, saved, .. } = self.sampling;
        if min == max {
            return format!("{max} spp");
        }
        format!("{mean:.1} spp ({min} to {max}): {:.1} % less than {max} for all", saved * 100.0)
    }

    fn noise(&self) -> String {
        let SamplingSummary { noise: Some(noise), worst_noise: Some(worst), tiles, tiles_done, .. } = self.sampling
        else {
            return String::new();
        };
        let target = self.noise_target.map(|target| format!("; {tiles_done} of {tiles} tiles reached {target}"));
        format!("noise    {noise:.5}, {worst:.5} in the worst tile{}\n", target.unwrap_or_default())
    }

    /// Whether the noise target, if there is one, was reached.
    ///
    /// # Errors
    /// [`Error::Check`] that says what stopped the picture.
    pub fn judge(&self) -> Result<()> {
        let SamplingSummary { tiles, tiles_done, worst_noise, max, .. } = self.sampling;
        let Some(target) = self.noise_target.filter(|_| tiles_done < tiles) else { return Ok(()) };
        let (stopped, remedy) = match self.time_limit {
            Some(limit) if max < self.spp => (format!("{limit} s (--time-limit)"), "more time"),
            _ => (format!("{max} samples (--spp)"), "more samples"),
        };
        let worst = worst_noise.map_or("unknown".to_owned(), |noise| format!("{noise:.5}"));
        Err(Error::Check(format!(
            "{} of {tiles} tiles are above --noise-target {target} after {stopped}, the worst noise is {worst}; \
             the picture was written; allow {remedy} or more noise",
            tiles - tiles_done
        )))
    }

    /// As texts for the EXR header.
    pub fn attributes(&self) -> BTreeMap<String, String> {
        let mut all = BTreeMap::new();
        let mut put = |key: &str, value: String| all.insert(key.to_owned(), value);
        put("triangles", self.head.scene.bvh.triangles.to_string());
        put("nodes", self.head.scene.bvh.nodes.to_string());
        put("maxDepth", self.max_depth.to_string());
        put("mraysPerSecond", format!("{:.6}", self.mrays_per_s));
        put("samples.mean", self.sampling.mean.to_string());
        put("samples.min", self.sampling.min.to_string());
        put("samples.max", self.sampling.max.to_string());
        if let Some(noise) = self.sampling.noise {
            put("noise", noise.to_string());
        }
        put("compiledOut", self.compiled_out.join(", "));
        for (kind, count) in &self.rays {
            put(&format!("rays.{kind}"), count.to_string());
        }
        for (step, seconds) in self.seconds.iter().chain(&self.stage_seconds) {
            put(&format!("seconds.{}", step.replace(' ', "_")), format!("{seconds:.6}"));
        }
        all
    }
}
