//! Bounds of a scene, and the camera to see it by.

use glam::{Mat3, Mat4, Vec3};

use super::{Camera, Projection, Scene};
use crate::{Error, Result};

/// Vertical angle of the framing camera: near a 50 mm lens on 35 mm film held upright.
const YFOV: f32 = 40.0 * std::f32::consts::PI / 180.0;
/// From the framing camera to the scene: front, right and above, the three-quarter view.
const VIEW: Vec3 = Vec3::new(-0.55, -0.4, -1.0);

impl Scene {
    /// Smallest and largest corner of the box around all triangles; `None` if there are none.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let mut corners = self.positions.iter().flatten();
        let &first = corners.next()?;
        Some(corners.fold((first, first), |(low, high), &p| (low.min(p), high.max(p))))
    }
}

/// A perspective camera that sees the whole scene in any picture that is at least as wide as high. An
/// empty scene is treated as a ball at the origin, a scene of one point as a ball around it.
pub fn framing_camera(scene: &Scene) -> Camera {
    let (low, high) = scene.bounds().unwrap_or_default();
    // In halves, as the sum of two large numbers may overflow.
    let center = low * 0.5 + high * 0.5;
    let radius = match (high * 0.5 - low * 0.5).length() {
        // The square of a length beyond 1e19 is infinite; no camera frames such a scene well.
        r if !r.is_finite() => f32::MAX.sqrt(),
        // A point is framed as a ball that is large enough to move away from it.
        r if r < 1e-6 * center.length() || r == 0.0 => f32::max(1.0, 1e-3 * center.length()),
        r => r,
    };
    let z = -VIEW.normalize();
    let x = Vec3::Y.cross(z).normalize();
    let axes = Mat3::from_cols(x, z.cross(x), z);
    // The bounding sphere touches the upper and lower edge of the picture.
    let eye = center + z * (radius / f32::sin(YFOV / 2.0));
    Camera {
        name: None,
        world_from_camera: Mat4::from_translation(eye) * Mat4::from_mat3(axes),
        projection: Projection::Perspective { yfov: YFOV },
    }
}

/// The camera of that name or index in [`Scene::cameras`]; without either the first one, and in a scene
/// without cameras the framing one.
///
/// # Errors
///
/// [`Error::Usage`] if there is no such camera; it lists those that there are.
pub fn select_camera(scene: &Scene, which: Option<&str>) -> Result<Camera> {
    let Some(which) = which else {
        return Ok(scene.cameras.first().cloned().unwrap_or_else(|| framing_camera(scene)));
    };
    let named = scene.cameras.iter().find(|camera| camera.name.as_deref() == Some(which));
    let numbered = || scene.cameras.get(which.parse::<usize>().ok()?);
    named.or_else(numbered).cloned().ok_or_else(|| {
        let list: Vec<String> = (scene.cameras.iter().enumerate())
            .map(|(i, camera)| camera.name.as_ref().map_or(i.to_string(), |name| format!("{i} ({name})")))
            .collect();
        let remedy = match list.is_empty() {
            true => "it has no cameras: leave the option out for one that frames the scene".into(),
            false => format!("it has {}", list.join(", ")),
        };
        Error::usage(format!("{} has no camera {which:?}", scene.name), remedy)
    })
}
