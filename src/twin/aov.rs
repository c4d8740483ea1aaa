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
        *aov = pixel(stage, ray, hit, counters);
    });
}

fn pixel(stage: Stage, ray: &Ray, hit: &Hit, counters: &RayCounters) -> AovPixel {
    let mut pixel = AovPixel {
        z: Z_NOTHING,
        prim: NO_HIT,
        steps: counters.node_visits as f32,
        migrations: counters.migrations as f32,
        subtrees: counters.subtrees as f32,
        ..AovPixel::default()
    };
    if ray.is_live() && hit.is_hit() {
        let s = surface_at(stage, ray, hit);
        let position = Vec3::from(ray.origin) + Vec3::from(ray.direction) * hit.t;
        pixel.normal = s.normal.into();
        pixel.albedo = s.color.into();
        pixel.prim = hit.prim;
        pixel.position = position.into();
        pixel.z = dot3(position - Vec3::from(stage.frame.camera_origin), stage.frame.camera_forward.into());
    }
    pixel
}
