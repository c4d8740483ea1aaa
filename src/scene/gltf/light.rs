//! Punctual lights of placed nodes (KHR_lights_punctual).

use std::f32::consts::FRAC_PI_2;

use glam::{DVec3, Vec3};
use gltf::json::Root;
use gltf::json::extensions::scene::khr_lights_punctual::{Light as JsonLight, Type};
use gltf::json::validation::Checked;

use super::material::Ranges;
use super::nodes::Placed;
use super::remarks::Remarks;
use super::source::Source;
use crate::Result;
use crate::scene::{Light, LightKind};

/// The lights that a file defines.
pub(super) fn list(root: &Root) -> &[JsonLight] {
    let lights = root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
    lights.map_or(&[], |lights| &lights.lights)
}

/// The lights of the scene, one for each node that holds one. Scale affects neither their intensity nor
/// their range.
pub(super) fn collect(source: &Source, root: &Root, placed: &[Placed], remarks: &mut Remarks) -> Result<Vec<Light>> {
    let mut lights = Vec::new();
    for place in placed {
        let held = root.nodes[place.node].extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        if let Some(held) = held {
            let index = held.light.value();
            let mut ranges = Ranges { source, object: format!("light {index}"), remarks };
            lights.push(convert(&mut ranges, &list(root)[index], place)?);
        }
    }
    Ok(lights)
}

fn convert(ranges: &mut Ranges, light: &JsonLight, place: &Placed) -> Result<Light> {
    let fault = |ranges: &Ranges, problem: &str, remedy: &str| ranges.source.fault(&ranges.object, problem, remedy);
    let color = ranges.clamp_all("A light's color", light.color, 0.0..=1.0)?;
    let intensity = ranges.clamp("A light's intensity", light.intensity, 0.0..=f32::MAX)?;
    let range = match light.range {
        None => f32::INFINITY,
        Some(range) => ranges.clamp("A light's range", range, f32::MIN_POSITIVE..=f32::MAX)?,
    };
    let position = place.world.translation.as_vec3();
    if !position.is_finite() {
        return Err(fault(ranges, "is placed beyond the largest number", "correct its node's transform"));
    }
    let kind = match (&light.type_, &light.spot) {
        (Checked::Valid(Type::Directional), _) => LightKind::Directional { direction: direction(ranges, place)? },
        (Checked::Valid(Type::Point), _) => LightKind::Point { position, range },
        (Checked::Valid(Type::Spot), Some(spot)) => {
            let outer = ranges.clamp("outerConeAngle", spot.outer_cone_angle, f32::EPSILON..=FRAC_PI_2)?;
            let inner = ranges.clamp("innerConeAngle", spot.inner_cone_angle, 0.0..=outer)?;
            LightKind::Spot {
                position,
                direction: direction(ranges, place)?,
                range,
                cos_inner: inner.cos(),
                cos_outer: outer.cos(),
            }
        }
        (Checked::Valid(Type::Spot), None) => {
            return Err(fault(ranges, "is a spot without its cone", "add the object spot"));
        }
        (Checked::Invalid, _) => return Err(fault(ranges, "type is unknown", "use directional, point or spot")),
    };
    Ok(Light { name: light.name.clone(), intensity: color.map(|c| c * intensity), kind })
}

/// Lights shine along -z of their node.
fn direction(ranges: &Ranges, place: &Placed) -> Result<Vec3> {
    let direction = place.world.transform_vector3(DVec3::NEG_Z).try_normalize();
    direction.map(|d| d.as_vec3()).ok_or_else(|| {
        let problem = format!("has no direction: node {} flattens it", place.node);
        ranges.source.fault(&ranges.object, problem, "give the node and its parents a scale other than 0")
    })
}
