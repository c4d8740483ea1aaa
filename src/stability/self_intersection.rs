//! Ray offset: secondary rays that meet the surface that they leave, or leave out what is near.

use bytemuck::Zeroable;
use glam::Vec3;

use super::naive::{EPSILON, fixed_epsilon};
use super::shapes::{bipyramid, ray, tree};
use super::{Effort, Finding, Study, worst};
use crate::Result;
use crate::layout::{Frame, Ray, StagePush};
use crate::report::chart::{Axis, Chart, Series, Style};
use crate::scene::Scene;
use crate::scene::procedural::random::Random;
use crate::scene::tables::Tables;
use crate::shared::KIND_DIFFUSE;
use crate::twin::secondary::secondary;
use crate::twin::surface::Stage;
use crate::twin::trace::hits;

const SIDES: u32 = 24;

/// Parts of the secondary rays: the usual method's false shadows and light leaks, then this program's.
type Rates = [f64; 4];

pub fn study(effort: Effort) -> Result<Study> {
    let count = effort.of(2_000, 50_000);
    let scales: Vec<f64> = (-6..=6).map(|e| 10f64.powi(e)).collect();
    let rates: Vec<Rates> = scales.iter().map(|&scale| rates(scale as f32, count)).collect::<Result<_>>()?;
    let curve = |k: usize| -> Vec<(f64, f64)> { scales.iter().zip(&rates).map(|(&x, rates)| (x, rates[k])).collect() };
    let naive = "the hit point, and 1e-4 left out";
    let finding = |regime: &str, measure, k: usize| Finding {
        method: "ray offset",
        regime: regime.to_owned(),
        measure,
        naive,
        naive_failure: worst(&curve(k)),
        failure: worst(&curve(k + 2)),
        uses: "the interpolated hit point moved along the normal by 2^-19 of the triangle's largest coordinate (twin/surface.rs)",
    };
    Ok(Study {
        about: "Diffuse rays that leave a closed convex mesh, whose radius is the scale, outside and inside. Outside none \
                may hit anything, inside all must.",
        findings: vec![
            finding("scale 1e-6 to 1e6, outside", "false shadows, part of the rays", 0),
            finding("scale 1e-6 to 1e6, inside", "light leaks, part of the rays", 1),
        ],
        charts: vec![Chart {
            title: "False shadows and light leaks against the scale of the scene".to_owned(),
            x: Axis::log("scale", "units"),
            y: Axis::log("wrong rays", "part of all"),
            series: vec![
                Series::new(format!("fixed {EPSILON:e}: false shadows"), Style::Line, curve(0)),
                Series::new(format!("fixed {EPSILON:e}: leaks"), Style::Line, curve(1)),
                Series::new("this program: false shadows", Style::Line, curve(2)),
                Series::new("this program: leaks", Style::Line, curve(3)),
            ],
            note: format!("{count} rays a point"),
        }],
    })
}

fn rates(scale: f32, count: usize) -> Result<Rates> {
    let positions = bipyramid(SIDES, scale, Vec3::ZERO);
    let bvh = tree(&positions)?;
    let scene = Scene { material_ids: vec![0; positions.len()], positions, ..Scene::default() };
    let (tables, frame) = (Tables::new(&scene), Frame::zeroed());
    let push = StagePush { argument: KIND_DIFFUSE, ..StagePush::zeroed() };
    let mut rates = [0.0; 4];
    for (side, distance) in [3.0, 0.0].into_iter().enumerate() {
        let first: Vec<Ray> = (0..count as u64).map(|i| first_ray(scale, distance, i)).collect();
        let found = hits(&bvh, &first);
        let mut next = vec![Ray::DEAD; count];
        secondary(Stage { bvh: &bvh, tables: &tables, frame: &frame }, push, &first, &found, &mut next);
        let naive: Vec<Ray> =
            first.iter().zip(&found).zip(&next).map(|((ray, hit), next)| fixed_epsilon(ray, hit, next)).collect();
        let live = next.iter().filter(|ray| ray.is_live()).count();
        for (k, rays) in [(0, &naive), (2, &next)] {
            let wrong = |(ray, hit): (&Ray, &crate::layout::Hit)| ray.is_live() && hit.is_hit() == (distance > 0.0);
            let wrong = rays.iter().zip(&hits(&bvh, rays)).filter(|&pair| wrong(pair)).count();
            rates[k + side] = wrong as f64 / live.max(1) as f64;
        }
    }
    Ok(rates)
}

/// From `distance` times the scale around the mesh, or from its middle, towards its middle or anywhere.
fn first_ray(scale: f32, distance: f32, index: u64) -> Ray {
    let random = &mut Random::stream(4, index);
    let origin = random.direction() * distance + random.in_cube() * if distance > 0.0 { 0.0 } else { 0.2 };
    let target = if distance > 0.0 { random.in_ball() * 0.7 } else { origin + random.direction() };
    ray(origin * scale, target - origin)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fixed_epsilon_shadows_large_scenes_and_leaks_in_small_ones() {
        let [shadows, _, own_shadows, own_leaks] = rates(1e6, 2_000).unwrap();
        assert!(shadows > 0.01 && own_shadows == 0.0 && own_leaks == 0.0, "{shadows} {own_shadows} {own_leaks}");
        let [_, leaks, own_shadows, own_leaks] = rates(1e-6, 2_000).unwrap();
        assert!(leaks > 0.9 && own_shadows == 0.0 && own_leaks == 0.0, "{leaks} {own_shadows} {own_leaks}");
    }
}
