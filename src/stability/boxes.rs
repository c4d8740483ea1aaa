//! Box test: rays in the plane of a box's face, and boxes that rounding takes away from the ray.

use glam::Vec3;

use super::naive::slabs;
use super::shapes::ray;
use super::{Effort, Finding, Study, rate, worst};
use crate::Result;
use crate::layout::{Hit, Ray, Triangle};
use crate::report::chart::{Axis, Chart, Series, Style};
use crate::scene::procedural::random::Random;
use crate::shared::NO_HIT;
use crate::twin::box_test::{box_ray, box_spans};
use crate::twin::triangle::{intersect, shear_of};

const USES: &str = "conservative slabs: directions have a floor, planes move out (Ize 2013; twin/box_test.rs)";
const NAIVE: &str = "slabs with min and max";

pub fn study(effort: Effort) -> Result<Study> {
    let count = effort.of(4_000, 100_000);
    let steps: Vec<u32> = [0].into_iter().chain((0..=16).step_by(2).map(|e| 1 << e)).collect();
    let planes = |meets: Meets, zero: f32| -> Vec<(f64, f64)> {
        steps.iter().map(|&s| (f64::from(s), rate(count, |i| !case(meets, s, zero, i)))).collect()
    };
    let plane = [planes(naive, 0.0), planes(naive, -0.0), planes(own, 0.0), planes(own, -0.0)];
    let offsets: Vec<f64> = (0..=6).map(|e| 10f64.powi(e)).collect();
    let lost = |meets: Meets| -> Vec<(f64, f64)> {
        offsets.iter().map(|&offset| (offset, rate(10 * count, |i| is_lost(meets, offset as f32, i)))).collect()
    };
    let rounding = [lost(naive), lost(own)];
    let finding = |regime: &str, measure, naive_failure, failure| Finding {
        method: "box test",
        regime: regime.to_owned(),
        measure,
        naive: NAIVE,
        naive_failure,
        failure,
        uses: USES,
    };
    let plane_measure = "boxes missed, part of the rays that touch them";
    Ok(Study {
        about: "Rays along an axis, at a distance of so many steps of a float inside from a box's face, with zeros of \
                either sign; and triangles that are hit, whose own box a ray must meet, at a distance from the origin.",
        findings: vec![
            finding("axis-parallel rays in a face's plane, +0", plane_measure, worst(&plane[0]), worst(&plane[2])),
            finding("axis-parallel rays in a face's plane, -0", plane_measure, worst(&plane[1]), worst(&plane[3])),
            finding(
                "flat boxes 1 to 1e6 from the origin",
                "boxes missed, part of the triangles aimed at",
                worst(&rounding[0]),
                worst(&rounding[1]),
            ),
        ],
        charts: vec![
            Chart {
                title: "Boxes missed by rays in a plane of theirs".to_owned(),
                x: Axis::log("distance from the plane", "steps of a float"),
                y: Axis::linear("boxes missed", "part of all"),
                series: ["slabs, +0", "slabs, -0", "this program, +0", "this program, -0"]
                    .into_iter()
                    .zip(plane)
                    .map(|(name, curve)| Series::new(name, Style::Line, curve))
                    .collect(),
                note: format!("{count} rays a point"),
            },
            Chart {
                title: "Triangles hit whose box is missed".to_owned(),
                x: Axis::log("offset", "units"),
                y: Axis::log("lost triangles", "part of all"),
                series: vec![
                    Series::new(NAIVE, Style::Line, rounding[0].clone()),
                    Series::new("conservative (this program)", Style::Line, rounding[1].clone()),
                ],
                note: format!("{} rays a point, aimed at an edge in a face of its box", 10 * count),
            },
        ],
    })
}

/// Whether a ray meets a box, in a scene that is the box.
type Meets = fn(&Ray, Vec3, Vec3) -> bool;

fn naive(ray: &Ray, low: Vec3, high: Vec3) -> bool {
    slabs(ray, low, high)
}

fn own(ray: &Ray, low: Vec3, high: Vec3) -> bool {
    box_spans(&box_ray(ray, low, high), low, high, ray.t_min, ray.t_max).hits().0
}

/// Ray `index` along an axis through a box, `steps` inside from the plane of a face beside it.
fn case(meets: Meets, steps: u32, zero: f32, index: u64) -> bool {
    let random = &mut Random::stream(5, index);
    let low = random.in_cube() * 10.0;
    let high = low + (random.in_cube() + Vec3::splat(1.5));
    let (along, beside) = (index as usize % 3, (index as usize + 1 + index as usize / 3 % 2) % 3);
    let mut origin = low.lerp(high, 0.5);
    let up = (index / 6).is_multiple_of(2);
    let moved = if up { stepped(low[beside], steps as i32) } else { stepped(high[beside], -(steps as i32)) };
    origin[beside] = moved.clamp(low[beside], high[beside]);
    let mut direction = Vec3::splat(zero);
    direction[along] = if (index / 12).is_multiple_of(2) { 1.0 } else { -1.0 };
    origin[along] -= 20.0 * direction[along];
    meets(&Ray { direction: direction.into(), ..ray(origin, direction) }, low, high)
}

/// The float `steps` above `value`.
fn stepped(value: f32, steps: i32) -> f32 {
    // Floats in their order as integers, zeros of both signs as 0.
    let bits = value.to_bits() as i32;
    let place = if bits < 0 { i32::MIN - bits } else { bits } + steps;
    f32::from_bits(if place < 0 { i32::MIN - place } else { place } as u32)
}

/// Whether ray `index` hits a triangle with an edge in a face of its box, and not the box.
fn is_lost(meets: Meets, offset: f32, index: u64) -> bool {
    let random = &mut Random::stream(6, index);
    let at = Vec3::new(1.0, -0.6, 0.3) * offset;
    let corners = [Vec3::NEG_Z, Vec3::Z, Vec3::NEG_X].map(|corner| at + corner);
    let (low, high) = (corners[0].min(corners[1]).min(corners[2]), corners[0].max(corners[1]).max(corners[2]));
    let target = corners[0].lerp(corners[1], random.unit());
    let origin = target + random.direction() * random.between(0.01, 10.0);
    let ray = ray(origin, target - origin);
    let [v0, v1, v2] = corners.map(Into::into);
    let triangle = Triangle { v0, v1, v2, ..Triangle::default() };
    let mut hit = Hit { t: ray.t_max, prim: NO_HIT, u: 0.0, v: 0.0 };
    intersect(&ray, &box_ray(&ray, low, high), &shear_of(ray.direction), &triangle, &mut hit);
    hit.is_hit() && !meets(&ray, low, high)
}
