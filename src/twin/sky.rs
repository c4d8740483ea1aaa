//! Twin of `sky.glsl`.

use glam::Vec3;

use crate::layout::Frame;

/// Radiance of the sky in a direction.
pub fn sky(frame: &Frame, direction: Vec3) -> Vec3 {
    let height = direction.y.max(0.0);
    Vec3::from(frame.sky_horizon) * (1.0 - height) + Vec3::from(frame.sky_zenith) * height
}
