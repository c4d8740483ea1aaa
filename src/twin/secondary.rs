//! Twin of `secondary.comp`: the benchmark's secondary rays.

use glam::Vec3;
use rayon::prelude::*;

use super::random::random2;
use super::sampling::cosine_direction;
use super::surface::{Stage, surface_at};
use super::vec::{dot3, normalize3};
use crate::layout::{Hit, Ray, StagePush};
use crate::shared::{DIMENSION_DIRECTION, FAR_AWAY, KIND_AO, KIND_REFLECT};

/// One ray of kind `push.argument` from each hit; dead rays from misses.
pub fn secondary(stage: Stage, push: StagePush, rays: &[Ray], hits: &[Hit], secondary_rays: &mut [Ray]) {
    secondary_rays.par_iter_mut().zip(rays).zip(hits).enumerate().for_each(|(i, ((next, ray), hit))| {
        *next = if ray.is_live() && hit.is_hit() { from_hit(stage, push, ray, hit, i as u32) } else { Ray::DEAD };
    });
}

fn from_hit(stage: Stage, push: StagePush, ray: &Ray, hit: &Hit, i: u32) -> Ray {
    let s = surface_at(stage, ray, hit);
    let d = Vec3::from(ray.direction);
    let direction = match push.argument {
        KIND_REFLECT => normalize3(d - s.geometric * (2.0 * dot3(d, s.geometric))),
        _ => cosine_direction(
            s.geometric,
            random2(stage.frame.seed, push.first + i, DIMENSION_DIRECTION, push.sample_index),
        ),
    };
    let t_max = if push.argument == KIND_AO { stage.frame.ao_radius } else { FAR_AWAY };
    Ray { origin: s.position.into(), t_min: 0.0, direction: direction.into(), t_max }
}
