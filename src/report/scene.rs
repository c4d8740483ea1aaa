//! What a report says of a scene.

use serde::Serialize;

use crate::bvh::Bvh;
use crate::bvh::statistics::Statistics;
use crate::scene::{Projection, Scene, SceneReport};

/// Counts, bounds, cameras, materials and the BVH.
#[derive(Clone, Debug, Serialize)]
pub struct SceneSummary {
    /// As the user called it.
    pub name: String,
    /// Triangles, degenerate ones included.
    pub triangles: usize,
    /// Low and high corner; none for an empty scene.
    pub bounds: Option<[[f32; 3]; 2]>,
    /// Cameras in file order.
    pub cameras: Vec<CameraSummary>,
    /// Number of materials.
    pub materials: usize,
    /// Number of base-colour textures.
    pub textures: usize,
    /// Number of punctual lights.
    pub lights: usize,
    /// What was found while loading.
    pub loading: SceneReport,
    /// The BVH.
    pub bvh: Statistics,
}

/// A camera.
#[derive(Clone, Debug, Serialize)]
pub struct CameraSummary {
    /// Its name, if it has one.
    pub name: Option<String>,
    /// `perspective` or `orthographic`.
    pub projection: &'static str,
}

impl SceneSummary {
    /// Summary of `scene` with its BVH.
    pub fn new(scene: &Scene, bvh: &Bvh) -> SceneSummary {
        let camera = |camera: &crate::scene::Camera| CameraSummary {
            name: camera.name.clone(),
            projection: match camera.projection {
                Projection::Perspective { .. } => "perspective",
                Projection::Orthographic { .. } => "orthographic",
            },
        };
        SceneSummary {
            name: scene.name.clone(),
            triangles: scene.positions.len(),
            bounds: scene.bounds().map(|(low, high)| [low.into(), high.into()]),
            cameras: scene.cameras.iter().map(camera).collect(),
            materials: scene.materials.len(),
            textures: scene.textures.len(),
            lights: scene.lights.len(),
            loading: scene.report.clone(),
            bvh: Statistics::of(bvh),
        }
    }
}
