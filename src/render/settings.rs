//! What the user asks of a picture, and the frame that the kernels make of it.

use glam::Vec3;

use super::noise::Goal;
use crate::layout::Frame;
use crate::scene::{Camera, Projection};
use crate::twin::tiles::tile_count;
use crate::{Error, Result};

/// Sky from the horizon up: a clear day.
const SKY_HORIZON: Vec3 = Vec3::new(0.95, 0.97, 1.0);
const SKY_ZENITH: Vec3 = Vec3::new(0.65, 0.76, 0.95);

/// Ambient light under an open sky: the mean of the gradient over the hemisphere, cosine-weighted.
const AMBIENT: Vec3 = Vec3::new(0.750, 0.830, 0.967);

/// Most samples a pixel: their sum stays exact enough in a float.
pub const MAX_SPP: u32 = 65_536;

/// Most samples a pixel with a noise target, unless told otherwise: 16 times less noise than the least number of them.
pub const DEFAULT_MOST_SPP: u32 = 4096;

/// Most bounces: what fits the path's state.
pub const MAX_DEPTH: u32 = 64;

/// Size and sampling of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Samples a pixel; the most of them with a noise target or a time limit.
    pub spp: u32,
    /// Noise at which a tile needs no more samples, as [`TileSums::noise`](super::noise::TileSums::noise).
    pub noise_target: Option<f32>,
    /// Seconds after which no further sample is begun.
    pub time_limit: Option<f64>,
    /// Most bounces of a path.
    pub max_depth: u32,
    /// Seed of all random numbers.
    pub seed: u32,
    /// Length of ambient occlusion rays in world units.
    pub ao_radius: f32,
    /// Factor on the sky's radiance and the ambient light.
    pub sky: f32,
    /// The sky does not show and alpha is coverage.
    pub transparent: bool,
}

/// What the command line starts from; the length of ambient occlusion rays depends on the scene.
impl Default for Settings {
    fn default() -> Settings {
        Settings {
            width: 1024,
            height: 768,
            spp: 1,
            noise_target: None,
            time_limit: None,
            max_depth: 8,
            seed: 1,
            ao_radius: 1.0,
            sky: 1.0,
            transparent: false,
        }
    }
}

impl Settings {
    /// Ambient occlusion rays of a tenth of the scene's diagonal.
    pub fn default_ao_radius((low, high): (Vec3, Vec3)) -> f32 {
        (0.1 * (high - low).length()).max(f32::MIN_POSITIVE)
    }

    /// Refuses what cannot be rendered.
    ///
    /// # Errors
    /// [`Error::Usage`] naming the value and its range.
    pub fn check(&self) -> Result<()> {
        let range = |name: &str, value: u32, low: u32, high: u32| match (low..=high).contains(&value) {
            true => Ok(()),
            false => Err(Error::usage(format!("--{name} {value}"), format!("allowed are {low} to {high}"))),
        };
        let side = super::image::MAX_SIDE as u32;
        range("width", self.width, 1, side)?;
        range("height", self.height, 1, side)?;
        range("spp", self.spp, 1, MAX_SPP)?;
        range("max-depth", self.max_depth, 0, MAX_DEPTH)?;
        if tile_count(self.width, self.height).is_none() {
            return Err(Error::usage(
                format!("a picture of {} x {} pixels", self.width, self.height),
                "at most 2^32 pixels can be rendered at once",
            ));
        }
        for (name, value) in [("ao-radius", self.ao_radius), ("sky", self.sky)] {
            if !value.is_finite() || value < 0.0 {
                return Err(Error::usage(format!("--{name} {value}"), "it must be a number from 0 up"));
            }
        }
        self.check_goal()
    }

    fn check_goal(&self) -> Result<()> {
        if let Some(target) = self.noise_target.filter(|target| !(*target > 0.0 && *target <= 1.0)) {
            let what = format!("--noise-target {target}");
            return Err(Error::usage(what, "it must be above 0 and at most 1, such as 0.02"));
        }
        match self.time_limit.filter(|limit| !limit.is_finite() || *limit < 0.0) {
            Some(limit) => {
                Err(Error::usage(format!("--time-limit {limit}"), "it must be a number of seconds from 0 up"))
            }
            None => Ok(()),
        }
    }

    /// When to stop.
    pub fn goal(&self) -> Goal {
        Goal { most: self.spp, noise: self.noise_target, seconds: self.time_limit }
    }

    /// The frame for `camera`, without addresses.
    pub fn frame(&self, camera: &Camera) -> Frame {
        let aspect = f64::from(self.width) / f64::from(self.height);
        let (orthographic, half_height) = match camera.projection {
            Projection::Perspective { yfov } => (0, (f64::from(yfov) * 0.5).tan()),
            Projection::Orthographic { ymag, .. } => (1, f64::from(ymag)),
        };
        let axis = |k: usize| camera.world_from_camera.col(k).truncate();
        let vector = |v: Vec3| <[f32; 3]>::from(v);
        Frame {
            camera_origin: vector(axis(3)),
            width: self.width,
            camera_right: vector(axis(0) * (half_height * aspect) as f32),
            height: self.height,
            camera_up: vector(axis(1) * half_height as f32),
            orthographic,
            camera_forward: vector(-axis(2)),
            seed: self.seed,
            sky_zenith: vector(SKY_ZENITH * self.sky),
            ao_radius: self.ao_radius,
            sky_horizon: vector(SKY_HORIZON * self.sky),
            max_depth: self.max_depth,
            ambient: vector(AMBIENT * self.sky),
            transparent: self.transparent.into(),
            ..bytemuck::Zeroable::zeroed()
        }
    }
}
