//! Distances are as good as single precision allows, also where a ray grazes a long triangle.
#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod common;

use caribou::bvh::{Bvh, Quality};
use caribou::layout::{Hit, Ray};
use caribou::trace::{Query, TracerOptions};
use caribou::twin::random::pcg;
use caribou::twin::trace::trace_closest;
use common::closed::random;
use common::faults::{Fault, gpu_with_fault};
use glam::{DVec3, Vec3};

const TRIANGLES: u32 = 4_000;
const RAYS: u32 = 100_000;

/// Least and largest width of triangles over their length.
type Widths = [f32; 2];
const WIDE: Widths = [1e-3, 1.0];
/// So thin that their normals are rounding errors, for the most part.
const NEEDLES: Widths = [1e-8, 1e-5];

/// Errors allowed, in half steps of the farthest corner's distance over the cosine between ray and normal: what
/// moving and interpolating three corners and two scalar products of three terms can round, 3 + 3 + 2 x 3,
/// and the reciprocal and the product with it, on both sides of the quotient.
const ROUNDINGS: f64 = 16.0;

/// The next number between `low` and `high`, evenly by its logarithm.
fn magnitude(state: &mut u32, low: f32, high: f32) -> f32 {
    low * (high / low).powf(random(state))
}

/// The next point of the cube from -0.5 to 0.5.
fn point(state: &mut u32) -> Vec3 {
    Vec3::new(random(state), random(state), random(state)) - 0.5
}

fn direction(state: &mut u32) -> Vec3 {
    point(state).normalize_or(Vec3::X)
}

/// Triangle `index`: 1 to 100 units long, any way round.
fn triangle(index: u32, widths: Widths) -> [Vec3; 3] {
    let state = &mut pcg(index);
    let middle = point(state) * 1_000.0;
    let along = direction(state);
    let across = along.cross(direction(state)).normalize_or(along.any_orthonormal_vector());
    let length = magnitude(state, 1.0, 100.0);
    let width = length * magnitude(state, widths[0], widths[1]);
    let tip = random(state);
    [middle, middle + along * length, middle + along * length * tip + across * width]
}

/// Ray `index`: to a point of a triangle from within its length, at a slope from steep to a thousandth.
fn ray(triangles: &[[Vec3; 3]], index: u32) -> Ray {
    let state = &mut pcg(index ^ 0x5bd1_e995);
    let [a, b, c] = triangles[index as usize % triangles.len()];
    let (u, v) = (random(state), random(state));
    let target = a + (b - a) * u * (1.0 - v) + (c - a) * v;
    let normal = (b - a).cross(c - a).normalize_or(Vec3::X);
    let around = normal.cross(direction(state)).normalize_or(normal.any_orthonormal_vector());
    let towards = (around + normal * magnitude(state, 1e-3, 10.0)).normalize();
    let origin = target - towards * a.distance(b) * magnitude(state, 1e-2, 1.0);
    Ray { origin: origin.into(), t_min: 0.0, direction: towards.into(), t_max: f32::MAX }
}

fn scene(widths: Widths) -> (Vec<[Vec3; 3]>, Bvh, Vec<Ray>) {
    let triangles: Vec<_> = (0..TRIANGLES).map(|i| triangle(i, widths)).collect();
    let bvh = Bvh::build(&triangles, Quality::Medium).unwrap();
    let rays = (0..RAYS).map(|i| ray(&triangles, i)).collect();
    (triangles, bvh, rays)
}

/// Largest error of `distance(ray, hit, corners from the ray's origin)` over all hits, in roundings.
fn worst(
    triangles: &[[Vec3; 3]],
    rays: &[Ray],
    hits: &[Hit],
    distance: impl Fn(&Ray, &Hit, [DVec3; 3]) -> f64,
) -> (f64, Ray) {
    let errors = rays.iter().zip(hits).filter(|(_, hit)| hit.is_hit()).map(|(ray, hit)| {
        let (origin, direction) = (Vec3::from(ray.origin).as_dvec3(), Vec3::from(ray.direction).as_dvec3());
        let corners = triangles[hit.prim as usize].map(|corner| corner.as_dvec3() - origin);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        let slope = normal.dot(direction);
        let farthest = corners.map(DVec3::length).into_iter().fold(0.0, f64::max);
        let rounding = f64::from(f32::EPSILON) / 2.0 * farthest / slope.abs();
        ((distance(ray, hit, corners) - normal.dot(corners[0]) / slope).abs() / rounding, *ray)
    });
    errors.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
}

#[test]
fn distances_are_exact_but_for_a_few_roundings() {
    let (triangles, bvh, rays) = scene(WIDE);
    let hits = trace_closest(&bvh, &rays).0;
    assert!(hits.iter().filter(|hit| hit.is_hit()).count() > RAYS as usize / 2, "rays hit at all");
    let (roundings, ray) = worst(&triangles, &rays, &hits, |_, hit, _| hit.t.into());
    assert!(roundings <= ROUNDINGS, "{roundings} roundings: {ray:?}");
}

/// Shows that the rays are hard: the point that the weights of a hit give is not at its distance.
#[test]
fn weights_alone_do_not_tell_the_distance() {
    let (triangles, bvh, rays) = scene(WIDE);
    let hits = trace_closest(&bvh, &rays).0;
    let (roundings, _) = worst(&triangles, &rays, &hits, |ray, hit, [a, b, c]| {
        let (u, v) = (f64::from(hit.u), f64::from(hit.v));
        (a * (1.0 - u - v) + b * u + c * v).dot(Vec3::from(ray.direction).as_dvec3())
    });
    assert!(roundings > 4.0 * ROUNDINGS, "{roundings} roundings");
}

#[test]
fn gpu_distances_equal_the_twins() {
    let Some(gpu) = common::gpu() else { return };
    for widths in [WIDE, NEEDLES] {
        let (_, bvh, rays) = scene(widths);
        let twin = trace_closest(&bvh, &rays);
        for options in common::both_kernels(None) {
            let device = common::trace_on(&gpu, &bvh, &rays, Query::Closest, options);
            common::assert_same(&format!("{widths:?}"), &device, &twin, &rays);
        }
    }
}

/// Whether a device with the fault finds other hits than the twin; nothing without a device.
fn differs(widths: Widths, original: &'static str, planted: &'static str) -> Option<bool> {
    let fault = Fault { file: "include/triangle.glsl", original, planted };
    let (gpu, _folder) = gpu_with_fault(&["direct", "direct_cpu"], fault)?;
    let (_, bvh, rays) = scene(widths);
    let hits = common::trace_on(&gpu, &bvh, &rays, Query::Closest, TracerOptions::default()).0;
    Some(hits != trace_closest(&bvh, &rays).0)
}

#[test]
fn planted_faults_in_the_distance() {
    let faults = [
        ("weights alone", WIDE, "plane_depth(ray, shear, triangle, weights, depth) : depth", "depth : depth"),
        ("a corner in place of the point", WIDE, "weights.y * e + weights.z * f", "weights.y * e * 0.0"),
        ("the plane where weights would do", WIDE, "* range >", "* range * 64.0 >"),
        ("a hit behind its box", NEEDLES, "span.y), span.x)", "FAR_AWAY), span.x)"),
        ("a hit before its box", NEEDLES, "span.y), span.x)", "span.y), -FAR_AWAY)"),
    ];
    for widths in [WIDE, NEEDLES] {
        assert!(differs(widths, "? plane_depth", "?  plane_depth").is_none_or(|differs| !differs), "no fault");
    }
    for (what, widths, original, planted) in faults {
        assert!(differs(widths, original, planted).is_none_or(|differs| differs), "{what}");
    }
}
