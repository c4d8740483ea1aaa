//! Distance of a hit: what the weights of the edge test lose by cancellation, and what the triangle's plane keeps.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::naive::interpolated_distance;
use super::shapes::ray;
use super::{Effort, Finding, Study, worst};
use crate::Result;
use crate::layout::{Hit, Ray, Triangle};
use crate::report::chart::{Axis, Chart, Series, Style};
use crate::scene::procedural::random::Random;
use crate::shared::NO_HIT;
use crate::twin::box_test::box_ray;
use crate::twin::triangle::{intersect, shear_of};

const NAIVE: &str = "interpolation by the weights (Woop et al. 2013)";
const USES: &str = "plane through the weights' point where they have cancelled (twin/triangle.rs)";

/// Sine of the angle between ray and triangle where needles are tested.
const STEEP: f32 = 0.5;
/// Length over width of the triangles that rays graze.
const LONG: f32 = 100.0;

pub fn study(effort: Effort) -> Result<Study> {
    let rays = effort.of(4_000, 100_000);
    let needles = curves(rays, (0..=5).map(|e| 10f32.powi(e)), |aspect| (aspect, STEEP));
    let grazing = curves(rays, (0..=4).map(|e| 10f32.powi(-e)), |slope| (LONG, slope));
    let chart = |title: &str, x: Axis, curves: &[Vec<(f64, f64)>; 2]| Chart {
        title: title.to_owned(),
        x,
        y: Axis::log("largest error", "part of the distance"),
        series: vec![
            Series::new(NAIVE, Style::Line, curves[0].clone()),
            Series::new("by the plane where weights cancel (this program)", Style::Line, curves[1].clone()),
        ],
        note: format!("{rays} rays a point, against double precision"),
    };
    let finding = |regime: &str, curves: &[Vec<(f64, f64)>; 2]| Finding {
        method: "distance",
        regime: regime.to_owned(),
        measure: "largest error, part of the distance",
        naive: NAIVE,
        naive_failure: worst(&curves[0]),
        failure: worst(&curves[1]),
        uses: USES,
    };
    Ok(Study {
        about: "Rays from within a triangle's length to points of it: needles of ever smaller width, and ever flatter rays at \
                triangles 100 times as long as wide. What flatness alone costs, no arithmetic of single precision gets back.",
        findings: vec![finding("needles to 1e5", &needles), finding("slopes to 1e-4", &grazing)],
        charts: vec![
            chart("Distance at needles", Axis::log("length over width", ""), &needles),
            chart("Distance of rays that graze", Axis::log("slope", "sine"), &grazing),
        ],
    })
}

/// Largest relative errors of both methods over a range; `shape` gives a triangle's length over its width, and the slope.
fn curves(rays: usize, range: impl Iterator<Item = f32>, shape: impl Fn(f32) -> (f32, f32)) -> [Vec<(f64, f64)>; 2] {
    let mut curves = [Vec::new(), Vec::new()];
    for x in range {
        let (aspect, slope) = shape(x);
        let both = (0..rays as u64).into_par_iter().filter_map(|index| errors(index, aspect, slope));
        let largest = both.reduce(|| [0.0; 2], |a, b| [a[0].max(b[0]), a[1].max(b[1])]);
        (0..2).for_each(|k| curves[k].push((f64::from(x), largest[k])));
    }
    curves
}

/// Relative errors of both methods for one ray, unless it misses.
fn errors(index: u64, aspect: f32, slope: f32) -> Option<[f64; 2]> {
    let (corners, ray) = case(index, aspect, slope);
    let [v0, v1, v2] = corners.map(|corner| corner.to_array());
    let triangle = Triangle { v0, prim: 0, v1, pad1: 0, v2, pad2: 0 };
    let [a, b, c] = corners;
    let mut hit = Hit { t: ray.t_max, prim: NO_HIT, u: 0.0, v: 0.0 };
    let box_ray = box_ray(&ray, a.min(b).min(c), a.max(b).max(c));
    intersect(&ray, &box_ray, &shear_of(ray.direction), &triangle, &mut hit);
    let exact = plane_distance(&ray, corners);
    let error = |t: f32| ((f64::from(t) - exact) / exact).abs();
    hit.is_hit().then(|| [error(interpolated_distance(&ray, &hit, corners)), error(hit.t)])
}

/// A triangle of length 1, any way round, and a ray to a point of it.
fn case(index: u64, aspect: f32, slope: f32) -> ([Vec3; 3], Ray) {
    let random = &mut Random::stream(4, index);
    let along = random.direction();
    let normal = along.cross(random.direction()).try_normalize().unwrap_or(along.any_orthonormal_vector());
    let across = normal.cross(along) / aspect;
    let a = random.in_cube();
    let corners = [a, a + along, a + along * random.unit() + across];
    let weights = Vec3::new(random.between(0.1, 1.0), random.between(0.1, 1.0), random.between(0.1, 1.0));
    let weights = weights / (weights.x + weights.y + weights.z);
    let target = corners[0] * weights.x + corners[1] * weights.y + corners[2] * weights.z;
    let flat = normal.cross(random.direction()).try_normalize().unwrap_or(along);
    let direction = (flat * (1.0 - slope * slope).max(0.0).sqrt() + normal * slope).normalize();
    (corners, ray(target - direction * random.between(0.1, 1.0), direction))
}

fn plane_distance(ray: &Ray, corners: [Vec3; 3]) -> f64 {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    let (origin, direction) = (Vec3::from(ray.origin).as_dvec3(), Vec3::from(ray.direction).as_dvec3());
    let normal: DVec3 = (b - a).cross(c - a);
    normal.dot(a - origin) / normal.dot(direction)
}
