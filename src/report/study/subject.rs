//! A scene that is studied.

use cpu_time::ProcessTime;

use crate::bvh::Bvh;
use crate::layout::{Frame, Ray};
use crate::render::rays::{RayKind, twin_rays};
use crate::render::settings::Settings;
use crate::report::experiment::Recording;
use crate::scene::tables::Tables;
use crate::scene::{self, Camera, Scene};
use crate::trace::steps::steps_of;
use crate::{Error, Result};

/// A scene and what is needed to trace rays in it.
pub struct Subject {
    /// What charts call it: for files, their names without folder and ending.
    pub name: String,
    /// The scene.
    pub scene: Scene,
    /// Its BVH.
    pub bvh: Bvh,
    /// Its materials and attributes.
    pub tables: Tables,
    /// Where from it is seen: the first camera, or one that frames it.
    pub camera: Camera,
}

impl Subject {
    /// Of a scene with its BVH.
    ///
    /// # Errors
    /// As of finding a camera.
    pub fn new(name: &str, scene: Scene, bvh: Bvh) -> Result<Subject> {
        let stem = std::path::Path::new(name).file_stem().and_then(|stem| stem.to_str()).unwrap_or(name);
        let stem = stem.strip_prefix("builtin:").unwrap_or(stem);
        let (tables, camera) = (Tables::new(&scene), scene::select_camera(&scene, None)?);
        Ok(Subject { name: stem.to_owned(), scene, bvh, tables, camera })
    }

    /// Size and sampling of a picture of it, by default in all else.
    pub fn settings(&self, (width, height): (u32, u32)) -> Settings {
        Settings { width, height, ao_radius: Settings::default_ao_radius(self.bvh.bounds), ..Settings::default() }
    }

    /// Frame of a picture of it.
    pub fn frame(&self, size: (u32, u32)) -> Frame {
        self.settings(size).frame(&self.camera)
    }

    /// Rays of a picture of it.
    ///
    /// # Errors
    /// [`Error::Usage`] if there are none.
    pub fn rays(&self, size: (u32, u32), kind: RayKind) -> Result<Vec<Ray>> {
        let rays = twin_rays(&self.bvh, &self.tables, &self.frame(size), kind);
        if rays.is_empty() {
            let what = format!("{}: no {} rays, because the camera sees nothing", self.name, kind.name());
            return Err(Error::usage(what, "give a scene with a camera that sees it"));
        }
        Ok(rays)
    }

    /// What such rays do in the tree, and the CPU seconds to find out.
    pub fn record(&self, rays: &[Ray], kind: RayKind) -> (Recording, f64) {
        let start = ProcessTime::now();
        let trace = steps_of(&self.bvh, rays, kind.query());
        let children = self.bvh.nodes.iter().map(|node| node.child).collect();
        let recording =
            Recording { trace, children, triangles: self.bvh.references(), nodes: Vec::new(), bounds: self.bvh.bounds };
        (recording, start.elapsed().as_secs_f64())
    }
}
