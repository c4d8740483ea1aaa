//! Twin of `aov.comp`: what each camera ray met.

use glam::Vec3;
use rayon::prelude::*;

use super::surface::{Stage, surface_at};
use super::vec::dot3;
use crate::layout::{AovPixel, Hit, Ray, RayCounters};
use crate::shared::{NO_HIT, Z_NOTHING};

/// Fills `aovs` from the hits of camera rays.
pub fn aov(stage: Stage, rays: &[Ray], hits: &[Hit], counters: &[RayCounters], aovs: &mut [AovPixel]) {
    aovs.par_iter_mut().zip(rays).zip(hits).zip(counters).for_each(|(((aov, ray), hit), counters)| {
        *aov = pixel(stage, ray, hit, counters.node_visits as f32);
    });
}

fn pixel(stage: Stage, ray: &Ray, hit: &Hit, steps: f32) -> AovPixel {
    if !ray.is_live() || !hit.is_hit() {
        return AovPixel { normal: [0.0; 3], z: Z_NOTHING, albedo: [0.0; 3], prim: NO_HIT, position: [0.0; 3], steps };
    }
    let s = surface_at(stage, ray, hit);
    let position = Vec3::from(ray.origin) + Vec3::from(ray.direction) * hit.t;
    let z = dot3(position - Vec3::from(stage.frame.camera_origin), stage.frame.camera_forward.into());
    AovPixel { normal: s.normal.into(), z, albedo: s.color.into(), prim: hit.prim, position: position.into(), steps }
}
