//! Twin of `light.comp`: shadow and ambient occlusion rays.

use glam::Vec3;
use rayon::prelude::*;

use super::exact::{exact_rcp, exact_sqrt};
use super::material::diffuse_color;
use super::random::random2;
use super::sampling::cosine_direction;
use super::surface::{Stage, Surface, surface_at};
use super::vec::{dot3, max3};
use crate::layout::{Contribution, Hit, Light, Path, Ray, StagePush};
use crate::shared::*;

const INVERSE_PI: f32 = std::f32::consts::FRAC_1_PI;

struct Arrival {
    direction: Vec3,
    distance: f32,
    irradiance: Vec3,
}

fn arrival(light: &Light, point: Vec3) -> Arrival {
    let (axis, intensity) = (Vec3::from(light.direction), Vec3::from(light.intensity));
    if light.kind == LIGHT_DIRECTIONAL {
        return Arrival { direction: -axis, distance: FAR_AWAY, irradiance: intensity };
    }
    let to = Vec3::from(light.position) - point;
    let distance2 = dot3(to, to);
    if distance2 < SQRT_FLOOR {
        return Arrival { direction: Vec3::ZERO, distance: 0.0, irradiance: Vec3::ZERO };
    }
    let distance = exact_sqrt(distance2);
    let direction = to * exact_rcp(distance);
    let relative = distance * light.inverse_range;
    let relative2 = relative * relative;
    let mut fade = (1.0 - relative2 * relative2).max(0.0) * exact_rcp(distance2);
    if light.kind == LIGHT_SPOT {
        let cone = (-dot3(direction, axis) * light.angle_scale + light.angle_offset).clamp(0.0, 1.0);
        fade *= cone * cone;
    }
    Arrival { direction, distance, irradiance: intensity * fade }
}

fn is_black(c: Vec3) -> bool {
    max3(c) <= 0.0
}

fn shadow_ray(s: &Surface, light: &Light, weight: Vec3) -> (Ray, Vec3) {
    let a = arrival(light, s.position);
    let cosine = dot3(s.normal, a.direction);
    let brought = weight * a.irradiance * (cosine * INVERSE_PI);
    let useful = cosine > 0.0 && dot3(s.geometric, a.direction) > 0.0 && !is_black(brought);
    let t_max = if useful { a.distance } else { -1.0 };
    (Ray { origin: s.position.into(), t_min: 0.0, direction: a.direction.into(), t_max }, brought)
}

fn ambient_ray(stage: Stage, s: &Surface, weight: Vec3, path: &Path, sample: u32) -> (Ray, Vec3) {
    let frame = stage.frame;
    let dimension = DIMENSION_AO + (path.state & PATH_DEPTH_MASK) * DIMENSIONS;
    let direction = cosine_direction(s.geometric, random2(frame.seed, path.pixel, dimension, sample));
    let brought = weight * Vec3::from(frame.ambient);
    let t_max = if is_black(brought) { -1.0 } else { frame.ao_radius };
    (Ray { origin: s.position.into(), t_min: 0.0, direction: direction.into(), t_max }, brought)
}

/// Makes the shadow rays of one light (`push.argument`), and returns how many.
pub fn light(
    stage: Stage,
    push: StagePush,
    (rays, hits, paths): (&[Ray], &[Hit], &[Path]),
    shadow_rays: &mut [Ray],
    contributions: &mut [Contribution],
) -> u64 {
    let outputs = shadow_rays.par_iter_mut().zip(contributions);
    outputs
        .zip(rays)
        .zip(hits)
        .zip(paths)
        .map(|((((shadow, contribution), ray), hit), path)| {
            let (mut next, mut brought) = (Ray::DEAD, Vec3::ZERO);
            if ray.is_live() && hit.is_hit() {
                let s = surface_at(stage, ray, hit);
                let weight = Vec3::from(path.throughput) * diffuse_color(&s);
                (next, brought) = match push.argument {
                    LIGHT_AMBIENT => ambient_ray(stage, &s, weight, path, push.sample_index),
                    light => shadow_ray(&s, &stage.tables.lights[light as usize], weight),
                };
            }
            *shadow = next;
            *contribution = Contribution { radiance: brought.into(), pad: 0 };
            u64::from(next.is_live())
        })
        .sum()
}
