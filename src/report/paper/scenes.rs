//! The paper's scenes: files by name, or procedural scenes in their place.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::published;
use crate::bvh::{Bvh, Quality, statistics::Statistics};
use crate::render::rays::{Batch, RayKind, twin_batch};
use crate::render::settings::Settings;
use crate::scene::tables::Tables;
use crate::scene::{self, Camera, Scene, procedural};
use crate::trace::Ray;
use crate::{Error, Result};

/// Words in a file's name by which it is known, and the procedural scene that stands in, of each of
/// [`published::SCENES`].
const SOURCES: [(&[&str], &str); 4] =
    [(&["fairy", "forest"], "forest"), (&["conference"], "room"), (&["dragon"], "blob"), (&["buddha"], "blob")];

/// A scene: Table I.
#[derive(Clone, Debug, Serialize)]
pub struct SceneRow {
    /// The paper's.
    pub paper: published::Scene,
    /// The file or procedural scene.
    pub source: String,
    /// How it differs from the paper's, if it does.
    pub stand_in: Option<String>,
    /// Distinct corners of its triangles.
    pub vertices: usize,
    /// Triangles.
    pub triangles: usize,
    /// Inner nodes of its BVH.
    pub nodes: usize,
    /// Leaves with triangles.
    pub leaves: usize,
    /// Bytes of nodes and triangles.
    pub bytes: usize,
}

/// A scene to be measured.
pub struct Subject {
    /// The paper's.
    pub paper: published::Scene,
    /// The file, or the name of the procedural scene.
    pub source: String,
    /// How it differs from the paper's scene, if it does.
    pub stand_in: Option<String>,
    /// Vertices of its triangles where they are shared.
    pub vertices: usize,
    /// Statistics of its BVH.
    pub statistics: Statistics,
    /// Its BVH.
    pub bvh: Bvh,
    /// Child links of the nodes.
    pub children: Vec<[u32; 2]>,
    tables: Tables,
    camera: Camera,
}

impl Subject {
    /// Scene number `index` of [`published::SCENES`]: from `folder` if a file there has its name, else procedural.
    ///
    /// # Errors
    /// As of loading a file.
    pub fn find(index: usize, folder: Option<&Path>, quality: Quality) -> Result<Subject> {
        let paper = published::SCENES[index];
        let (words, recipe) = SOURCES[index];
        let file = folder.map(|folder| file_named(folder, words)).transpose()?.flatten();
        let (scene, source) = match &file {
            Some(path) => (scene::load(path)?, path.display().to_string()),
            None => (procedural::build(recipe, paper.triangles, 1)?, format!("procedural scene {recipe}")),
        };
        let stand_in = difference(&paper, &scene, file.as_deref());
        let camera = scene::select_camera(&scene, None)?;
        let bvh = Bvh::build(&scene.positions, quality)?;
        Ok(Subject {
            paper,
            source,
            stand_in,
            vertices: distinct_corners(&scene),
            statistics: Statistics::of(&bvh),
            children: bvh.nodes.iter().map(|node| node.child).collect(),
            bvh,
            tables: Tables::new(&scene),
            camera,
        })
    }

    /// Rays of `batch` in a picture of `width` by `height`; none if the camera sees nothing.
    pub fn rays(&self, (width, height): (u32, u32), batch: Batch) -> Vec<Ray> {
        let ao_radius = Settings::default_ao_radius(self.bvh.bounds);
        let settings = Settings { width, height, ao_radius, ..Settings::default() };
        twin_batch(&self.bvh, &self.tables, &settings.frame(&self.camera), batch)
    }
}

impl SceneRow {
    pub(super) fn of(subject: &Subject) -> SceneRow {
        let statistics = &subject.statistics;
        SceneRow {
            paper: subject.paper,
            source: subject.source.clone(),
            stand_in: subject.stand_in.clone(),
            vertices: subject.vertices,
            triangles: statistics.triangles,
            nodes: statistics.nodes,
            leaves: statistics.leaves,
            bytes: statistics.node_bytes + statistics.triangle_bytes,
        }
    }
}

/// The first file, by name, of the scenes in `folder` that has one of `words` in its name; without numbers first, as
/// these mark coarser copies.
fn file_named(folder: &Path, words: &[&str]) -> Result<Option<PathBuf>> {
    let entries = std::fs::read_dir(folder).map_err(Error::io("read", folder))?;
    let mut files: Vec<(bool, PathBuf)> = entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| {
            path.extension().is_some_and(|e| e.eq_ignore_ascii_case("glb") || e.eq_ignore_ascii_case("gltf"))
        })
        .filter_map(|path| {
            let name = path.file_stem()?.to_str()?.to_lowercase();
            words.iter().any(|word| name.contains(word)).then(|| (name.contains(|c: char| c.is_ascii_digit()), path))
        })
        .collect();
    files.sort();
    Ok(files.into_iter().next().map(|(_, path)| path))
}

fn difference(paper: &published::Scene, scene: &Scene, file: Option<&Path>) -> Option<String> {
    let count = scene.positions.len();
    let named = file.and_then(|path| path.file_stem()?.to_str()).unwrap_or_default();
    if file.is_none() {
        return Some("procedural, in place of a scene that was not found".to_owned());
    }
    if named.contains("substitute") {
        return Some("a substitute, by its file's name".to_owned());
    }
    let share = 100.0 * (count as f64 / paper.triangles as f64 - 1.0);
    (count != paper.triangles).then(|| format!("{share:+.1} % triangles"))
}

fn distinct_corners(scene: &Scene) -> usize {
    let mut corners: Vec<[u32; 3]> = scene.positions.iter().flatten().map(|p| p.to_array().map(f32::to_bits)).collect();
    corners.sort_unstable();
    corners.dedup();
    corners.len()
}

/// Rays of the primary and of the secondary rows.
pub fn batches(secondary: Batch) -> [Batch; 2] {
    [Batch { kind: RayKind::Primary, per_hit: 1, sorted: false }, secondary]
}
