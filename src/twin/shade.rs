//! Twin of `shade.comp`: where each path goes on from its hit.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::exact::exact_rcp;
use super::material::{dielectric, is_unlit, reflected, refracted, schlick};
use super::random::{random1, random2};
use super::sampling::{cosine_direction, sphere_direction};
use super::sky::sky;
use super::surface::{Stage, Surface, surface_at};
use super::vec::{dot3, normalize3};
use crate::layout::{Hit, Path, Ray, StagePush};
use crate::shared::*;

/// One path on its way through the kernel.
struct Shading<'a> {
    stage: Stage<'a>,
    sample: u32,
    indirect: u32,
    ray: Ray,
    path: Path,
}

impl Shading<'_> {
    fn dimension(&self, dimension: u32) -> u32 {
        (self.path.state & PATH_DEPTH_MASK) * DIMENSIONS + dimension
    }

    fn choice(&self, dimension: u32) -> f32 {
        random1(self.stage.frame.seed, self.path.pixel, self.dimension(dimension), self.sample)
    }

    fn choice2(&self, dimension: u32) -> Vec2 {
        random2(self.stage.frame.seed, self.path.pixel, self.dimension(dimension), self.sample)
    }

    fn direction(&self) -> Vec3 {
        self.ray.direction.into()
    }

    fn go_on(&mut self, origin: Vec3, direction: Vec3) {
        self.ray = Ray { origin: origin.into(), t_min: 0.0, direction: direction.into(), t_max: FAR_AWAY };
    }

    fn tint(&mut self, color: Vec3) {
        self.path.throughput = (Vec3::from(self.path.throughput) * color).into();
    }

    fn add(&mut self, radiance: Vec3) {
        let brought = Vec3::from(self.path.throughput) * radiance;
        self.path.radiance = (Vec3::from(self.path.radiance) + brought).into();
    }

    fn blurred(&self, direction: Vec3, side: Vec3, s: &Surface) -> Vec3 {
        let alpha = s.material.roughness * s.material.roughness;
        let rough = normalize3(direction + sphere_direction(self.choice2(DIMENSION_ROUGHNESS)) * alpha);
        if dot3(rough, side) > 0.0 { rough } else { direction }
    }

    fn reflect_path(&mut self, s: &Surface, tint: Vec3) -> Option<u32> {
        let mut mirror = reflected(self.direction(), s.normal);
        if dot3(mirror, s.geometric) <= 0.0 {
            mirror = reflected(self.direction(), s.geometric);
        }
        self.go_on(s.position, self.blurred(mirror, s.geometric, s));
        self.tint(tint);
        Some(KIND_REFLECT)
    }

    fn refract_path(&mut self, s: &Surface, cosine: f32, eta: f32) -> Option<u32> {
        let solid = s.material.flags & MATERIAL_SOLID != 0;
        let straight = self.direction();
        let mut through = if solid { refracted(straight, s.normal, cosine, eta) } else { straight };
        if dot3(through, s.geometric) >= 0.0 {
            through = straight;
        }
        self.go_on(s.below, self.blurred(through, -s.geometric, s));
        if !solid || s.front {
            self.tint(s.color);
        }
        Some(KIND_REFRACT)
    }

    fn glass_path(&mut self, s: &Surface) -> Option<u32> {
        let cosine = (-dot3(self.direction(), s.normal)).clamp(0.0, 1.0);
        let outside = exact_rcp(s.material.ior);
        let leaving = s.material.flags & MATERIAL_SOLID != 0 && !s.front;
        let eta = if leaving { s.material.ior } else { outside };
        if self.choice(DIMENSION_FRESNEL) < dielectric(cosine, eta) {
            return self.reflect_path(s, Vec3::ONE);
        }
        self.refract_path(s, cosine, eta)
    }

    fn diffuse_path(&mut self, s: &Surface) -> Option<u32> {
        if self.indirect != INDIRECT_DIFFUSE || self.path.state & PATH_BOUNCED != 0 {
            return None;
        }
        let direction = cosine_direction(s.normal, self.choice2(DIMENSION_DIRECTION));
        self.go_on(s.position, direction);
        if dot3(direction, s.geometric) <= 0.0 {
            return None;
        }
        self.tint(s.color);
        self.path.state |= PATH_BOUNCED;
        Some(KIND_DIFFUSE)
    }

    fn next_ray(&mut self, s: &Surface) -> Option<u32> {
        if is_unlit(&s.material) {
            self.add(s.color);
            return None;
        }
        let counted = self.stage.frame.lit != 0 && self.path.state & PATH_BOUNCED != 0;
        if !counted {
            self.add(s.material.emissive.into());
        }
        if self.path.state & PATH_DEPTH_MASK >= self.stage.frame.max_depth {
            return None;
        }
        if self.choice(DIMENSION_METAL) < s.material.metallic {
            let tint = schlick(s.color, -dot3(self.direction(), s.normal));
            return self.reflect_path(s, tint);
        }
        if self.choice(DIMENSION_TRANSMISSION) < s.material.transmission {
            return self.glass_path(s);
        }
        self.diffuse_path(s)
    }

    /// Kind of the next ray, if the path goes on.
    fn shade(&mut self, hit: &Hit) -> Option<u32> {
        let first = self.path.state & PATH_DEPTH_MASK == 0;
        let mut kind = None;
        if hit.is_hit() {
            if first {
                self.path.state |= PATH_COVERED;
            }
            let surface = surface_at(self.stage, &self.ray, hit);
            kind = self.next_ray(&surface);
        } else if !first || self.stage.frame.transparent == 0 {
            self.add(sky(self.stage.frame, self.direction()));
        }
        if kind.is_none() {
            self.ray.t_max = -1.0;
        }
        self.path.state += 1;
        kind
    }
}

/// Replaces each live ray by the next of its path, or ends the path; returns the new rays by kind.
pub fn shade(
    stage: Stage,
    push: StagePush,
    indirect: u32,
    rays: &mut [Ray],
    hits: &[Hit],
    paths: &mut [Path],
) -> [u64; KINDS as usize] {
    let add = |mut a: [u64; KINDS as usize], b: [u64; KINDS as usize]| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        a
    };
    rays.par_iter_mut()
        .zip(hits)
        .zip(paths)
        .fold(Default::default, |mut counts: [u64; KINDS as usize], ((ray, hit), path)| {
            if ray.is_live() {
                let mut shading = Shading { stage, sample: push.sample_index, indirect, ray: *ray, path: *path };
                if let Some(kind) = shading.shade(hit) {
                    counts[kind as usize] += 1;
                }
                (*ray, *path) = (shading.ray, shading.path);
            }
            counts
        })
        .reduce(Default::default, add)
}
