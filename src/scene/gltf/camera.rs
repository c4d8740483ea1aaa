//! Cameras of placed nodes.

use glam::{DAffine3, Mat4};
use gltf::json::camera::{self, Type};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};

use super::nodes::{Placed, orthonormal};
use super::source::Source;
use crate::scene::{Camera, Projection};
use crate::{Error, Result};

/// The cameras of the scene, in the order of the file's list of cameras. One that several nodes hold comes
/// once for each.
pub(super) fn collect(source: &Source, root: &Root, placed: &[Placed]) -> Result<Vec<Camera>> {
    let held = |place: &'_ Placed| root.nodes[place.node].camera;
    let mut found: Vec<(Index<camera::Camera>, &Placed)> =
        placed.iter().filter_map(|place| Some((held(place)?, place))).collect();
    found.sort_by_key(|(camera, _)| camera.value());
    found.into_iter().map(|(camera, place)| convert(source, root, camera, place)).collect()
}

fn convert(source: &Source, root: &Root, index: Index<camera::Camera>, place: &Placed) -> Result<Camera> {
    let camera = &root.cameras[index.value()];
    let Some(axes) = orthonormal(place.world.matrix3) else {
        let remedy = "give the camera's node and its parents a scale other than 0";
        return Err(source.fault(format!("node {}", place.node), "flattens the camera that it holds", remedy));
    };
    let frame = DAffine3::from_mat3_translation(axes, place.world.translation);
    let world_from_camera = Mat4::from_cols_array(&glam::DMat4::from(frame).to_cols_array().map(|x| x as f32));
    if !world_from_camera.is_finite() {
        let problem = "places its camera beyond the largest number";
        return Err(source.fault(format!("node {}", place.node), problem, "correct the node's transform"));
    }
    Ok(Camera {
        name: camera.name.clone().or_else(|| root.nodes[place.node].name.clone()),
        world_from_camera,
        projection: projection(source, index.value(), camera)?,
    })
}

fn projection(source: &Source, index: usize, camera: &camera::Camera) -> Result<Projection> {
    let fault = |problem: String, remedy: &str| -> Error { source.fault(format!("camera {index}"), problem, remedy) };
    match (&camera.type_, &camera.perspective, &camera.orthographic) {
        (Checked::Valid(Type::Perspective), Some(lens), _) => match lens.yfov {
            yfov if yfov > 0.0 && yfov < std::f32::consts::PI => Ok(Projection::Perspective { yfov }),
            yfov => Err(fault(format!("yfov is {yfov}"), "use an angle above 0 and below pi")),
        },
        (Checked::Valid(Type::Orthographic), _, Some(lens)) => match (lens.xmag.abs(), lens.ymag.abs()) {
            // Negative magnitudes are discouraged (section 5.16), not forbidden; they would mirror the picture.
            (xmag, ymag) if xmag > 0.0 && ymag > 0.0 && (xmag * ymag).is_finite() => {
                Ok(Projection::Orthographic { xmag, ymag })
            }
            _ => Err(fault(
                format!("xmag {} and ymag {} span no view", lens.xmag, lens.ymag),
                "use finite sizes above 0",
            )),
        },
        (Checked::Invalid, ..) => Err(fault("type is unknown".into(), "use perspective or orthographic")),
        (Checked::Valid(kind), ..) => {
            Err(fault(format!("is {kind:?} but does not say of which form"), "add the object of that name"))
        }
    }
}
