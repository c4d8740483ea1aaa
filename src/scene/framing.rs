//! Bounds of a scene, and the camera to see it by.

use glam::{DMat3, DVec3, Mat4, Vec3};

use super::{Camera, Projection, Scene};
use crate::{Error, Result};

/// Vertical angle of the framing camera: a mild telephoto, which keeps perspective natural.
const YFOV: f64 = 40.0 * std::f64::consts::PI / 180.0;
/// Where the framing camera looks: from front, right and above, the three-quarter view.
const VIEW: DVec3 = DVec3::new(-0.55, -0.4, -1.0);

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
    // In double precision, as sums and squares of large coordinates overflow in single.
    let (low, high) = scene.bounds().unwrap_or_default();
    let (low, high) = (low.as_dvec3(), high.as_dvec3());
    let center = (low + high) / 2.0;
    let radius = match (high - low).length() / 2.0 {
        // A point is framed as a ball that is large enough to move away from it in single precision.
        r if r <= 1e-6 * center.length() => f64::max(1.0, 1e-3 * center.length()),
        r => r,
    };
    let z = -VIEW.normalize();
    let x = DVec3::Y.cross(z).normalize();
    let axes = DMat3::from_cols(x, z.cross(x), z).as_mat3();
    // The bounding sphere touches the upper and lower edge of the picture.
    let eye = center + z * (radius / f64::sin(YFOV / 2.0));
    let largest = DVec3::splat(f64::from(f32::MAX));
    let eye = eye.clamp(-largest, largest).as_vec3();
    Camera {
        name: None,
        world_from_camera: Mat4::from_translation(eye) * Mat4::from_mat3(axes),
        projection: Projection::Perspective { yfov: YFOV as f32 },
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

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(corners: &[Vec3]) -> Scene {
        Scene { positions: corners.iter().map(|&c| [c; 3]).collect(), ..Scene::default() }
    }

    #[test]
    fn every_corner_of_the_bounds_is_in_the_picture() {
        for (low, high) in [
            (Vec3::splat(-1.0), Vec3::splat(1.0)),
            (Vec3::new(0.0, 0.0, 5.0), Vec3::new(10.0, 0.0, 5.0)),
            (Vec3::new(148376.0, 1234.0, -223423.0), Vec3::new(148377.0, 1235.0, -223422.0)),
            (Vec3::splat(1e-20), Vec3::splat(3e-20)),
        ] {
            let camera = framing_camera(&scene(&[low, high]));
            let to_camera = camera.world_from_camera.as_dmat4().inverse();
            for i in 0..8 {
                let pick = |bit: u32, a: f32, b: f32| if i >> bit & 1 == 0 { a } else { b };
                let corner = Vec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z));
                let p = to_camera.transform_point3(corner.as_dvec3());
                let edge = -p.z * f64::tan(YFOV / 2.0) * 1.01;
                assert!(p.z < 0.0 && p.x.abs() < edge && p.y.abs() < edge, "{low} {high}: {corner} is at {p}");
            }
        }
    }

    #[test]
    fn odd_scenes_have_a_usable_camera() {
        let far = Vec3::splat(f32::MAX);
        for corners in [&[][..], &[Vec3::ZERO], &[Vec3::X * 1e6], &[far], &[-far, far]] {
            let frame = framing_camera(&scene(corners)).world_from_camera;
            assert!(frame.is_finite(), "{corners:?}");
            assert!((frame.determinant() - 1.0).abs() < 1e-5, "{corners:?}");
        }
        let eye = framing_camera(&scene(&[Vec3::X * 1e6])).world_from_camera.w_axis.truncate();
        assert!(eye.distance(Vec3::X * 1e6) > 1.0, "moved away from the point");
    }
}
