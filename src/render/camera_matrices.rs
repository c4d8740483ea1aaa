//! The two camera matrices of an OpenEXR header, so that a compositor can place points in the picture.

use glam::{Mat4, Vec3};

use crate::scene::{Camera, Projection};

/// `(worldToCamera, worldToNDC)` of a picture with `aspect` = width / height and square pixels, for
/// column vectors.
///
/// By the description of OpenEXR's standard attributes (ImfStandardAttributes.h): camera space is
/// left-handed with x right, y up and z along the view; NDC has (0, 0) at the upper left and (1, 1) at
/// the lower right corner of the picture, after division by w. The vertical extent of the lens is kept
/// and the horizontal one follows from `aspect`.
pub fn camera_matrices(camera: &Camera, aspect: f32) -> (Mat4, Mat4) {
    // glTF's cameras look along -z, OpenEXR's along +z.
    let view = Mat4::from_scale(Vec3::new(1.0, 1.0, -1.0)) * camera.world_from_camera.inverse();
    (view, picture_from_clip() * projection(camera.projection, aspect) * view)
}

/// Camera space, z forward, to clip space with x and y in -w..w. The z row maps to 1 / z or z: finite
/// for every point before the camera, and not looked at by anyone (the attribute defines x and y only).
fn projection(projection: Projection, aspect: f32) -> Mat4 {
    match projection {
        Projection::Perspective { yfov } => {
            let scale = 1.0 / (0.5 * yfov).tan();
            Mat4::from_cols_array_2d(&[
                [scale / aspect, 0.0, 0.0, 0.0],
                [0.0, scale, 0.0, 0.0],
                [0.0, 0.0, 0.0, 1.0],
                [0.0, 0.0, 1.0, 0.0],
            ])
        }
        Projection::Orthographic { ymag, .. } => Mat4::from_scale(Vec3::new(1.0 / (ymag * aspect), 1.0 / ymag, 1.0)),
    }
}

/// -1..1 with y up to 0..1 with y down.
fn picture_from_clip() -> Mat4 {
    Mat4::from_translation(Vec3::new(0.5, 0.5, 0.0)) * Mat4::from_scale(Vec3::new(0.5, -0.5, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec2};

    /// Where the ray through a picture position must land again: the corners and the centre.
    const CORNERS: [(f32, f32); 5] = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (0.5, 0.5)];

    fn camera(projection: Projection) -> Camera {
        let rotation = Quat::from_euler(glam::EulerRot::YXZ, 0.7, -0.3, 0.1);
        let world_from_camera = Mat4::from_rotation_translation(rotation, Vec3::new(3.0, -2.0, 5.0));
        Camera { name: None, world_from_camera, projection }
    }

    fn assert_ndc(ndc: Mat4, world: Vec3, expected: (f32, f32)) {
        let found = ndc.project_point3(world).truncate();
        assert!(found.distance(Vec2::new(expected.0, expected.1)) < 1e-5, "{found} instead of {expected:?}");
    }

    #[test]
    fn perspective_corners_land_on_the_corners_at_any_depth() {
        let (aspect, yfov) = (1.5, 0.8f32);
        let camera = camera(Projection::Perspective { yfov });
        let (_, ndc) = camera_matrices(&camera, aspect);
        for (x, y) in CORNERS {
            for depth in [0.1, 1.0, 50.0] {
                let half_height = depth * (0.5 * yfov).tan();
                let local = Vec3::new((2.0 * x - 1.0) * half_height * aspect, (1.0 - 2.0 * y) * half_height, -depth);
                assert_ndc(ndc, camera.world_from_camera.transform_point3(local), (x, y));
            }
        }
    }

    #[test]
    fn orthographic_corners_land_on_the_corners_at_any_depth() {
        let camera = camera(Projection::Orthographic { xmag: 9.0, ymag: 2.0 });
        let (_, ndc) = camera_matrices(&camera, 1.5);
        for (x, y) in CORNERS {
            for depth in [0.1, 50.0] {
                let local = Vec3::new((2.0 * x - 1.0) * 3.0, (1.0 - 2.0 * y) * 2.0, -depth);
                assert_ndc(ndc, camera.world_from_camera.transform_point3(local), (x, y));
            }
        }
    }

    #[test]
    fn what_lies_ahead_has_positive_camera_z() {
        let camera = camera(Projection::Perspective { yfov: 0.8 });
        let (view, _) = camera_matrices(&camera, 1.0);
        let ahead = camera.world_from_camera.transform_point3(Vec3::new(1.0, 2.0, -4.0));
        assert!(view.transform_point3(ahead).distance(Vec3::new(1.0, 2.0, 4.0)) < 1e-5);
    }
}
