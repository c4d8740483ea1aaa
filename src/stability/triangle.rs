//! Triangle test: rays that slip between triangles that share an edge.

use glam::{Quat, Vec3};

use super::naive::moller_trumbore;
use super::shapes::{Positions, bipyramid, ray, ray_inside, tree};
use super::{Effort, Finding, Study, rate, worst};
use crate::Result;
use crate::bvh::Bvh;
use crate::layout::Ray;
use crate::report::chart::{Axis, Chart, Series, Style};
use crate::scene::procedural::random::Random;
use crate::twin::trace::hits;

const NAIVE: &str = "Möller and Trumbore 1997 in f32";
const USES: &str = "watertight test of Woop et al. 2013 in exact arithmetic (twin/triangle.rs)";

/// Radius of the closed mesh.
const RADIUS: f32 = 10.0;

pub fn study(effort: Effort) -> Result<Study> {
    let rays = effort.of(4_000, 100_000);
    let far = curves((0..=7).map(|e| 10f64.powi(e)), |offset| {
        let centre = Vec3::new(1.0, -0.7, 0.4) * offset as f32;
        let mesh = bipyramid(32, RADIUS, centre);
        leaks(&mesh, rays, |i| ray_inside(&mesh, (centre, RADIUS), i))
    })?;
    let thin = curves((0..=6).map(|e| 10f64.powi(-e)), |angle| {
        let mesh = slivers(angle as f32);
        leaks(&mesh, rays, |i| ray_at_sliver(&mesh, i))
    })?;
    let chart = |title: &str, x: Axis, curves: &[Vec<(f64, f64)>; 2]| Chart {
        title: title.to_owned(),
        x,
        y: Axis::log("rays that leak", "part of all"),
        series: vec![
            Series::new(NAIVE, Style::Line, curves[0].clone()),
            Series::new("watertight (this program)", Style::Line, curves[1].clone()),
        ],
        note: format!("{rays} rays a point, aimed at corners, edges and faces"),
    };
    let finding = |regime: &str, curves: &[Vec<(f64, f64)>; 2]| Finding {
        method: "triangle test",
        regime: regime.to_owned(),
        measure: "rays that leak, part of all",
        naive: NAIVE,
        naive_failure: worst(&curves[0]),
        failure: worst(&curves[1]),
        uses: USES,
    };
    Ok(Study {
        about: "Rays from inside a closed mesh of radius 10, moved away from the origin; and rays at two triangles that \
                a sliver of ever smaller angle keeps apart. Each ray must hit something.",
        findings: vec![finding("mesh 1 to 1e7 from the origin", &far), finding("edges at 1 to 1e-6 rad", &thin)],
        charts: vec![
            chart("Leaks against distance from the origin", Axis::log("offset", "units"), &far),
            chart("Leaks against the angle between edges", Axis::log("angle", "rad"), &thin),
        ],
    })
}

/// Leak rates of both methods over a range.
fn curves(range: impl Iterator<Item = f64>, leaks: impl Fn(f64) -> Result<[f64; 2]>) -> Result<[Vec<(f64, f64)>; 2]> {
    let mut curves = [Vec::new(), Vec::new()];
    for x in range {
        let leaks = leaks(x)?;
        (0..2).for_each(|k| curves[k].push((x, leaks[k])));
    }
    Ok(curves)
}

/// Parts of the rays that the usual test and this program's let through.
fn leaks(mesh: &Positions, count: usize, ray: impl Fn(u64) -> Ray + Sync) -> Result<[f64; 2]> {
    let naive = rate(count, |i| !mesh.iter().any(|&triangle| moller_trumbore(&ray(i), triangle)));
    let bvh: Bvh = tree(mesh)?;
    let rays: Vec<Ray> = (0..count as u64).map(ray).collect();
    let missed = hits(&bvh, &rays).iter().filter(|hit| !hit.is_hit()).count();
    Ok([naive, missed as f64 / count as f64])
}

/// A square in general position, cut from a corner by two edges at `angle`.
fn slivers(angle: f32) -> Positions {
    let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.3, 0.5, 0.7);
    let square = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let [a, b, c, d] = square.map(|(x, y)| turn * Vec3::new(x, y, 0.0));
    // On the edge from c to b, as seen from a: the diagonal is 2 sqrt 2 long and meets that edge at half a right angle.
    let e = c.lerp(b, (2.0 * angle).min(0.9));
    vec![[a, b, e], [a, e, c], [a, c, d]]
}

/// From above the square to a point of the sliver or its edges.
fn ray_at_sliver(mesh: &Positions, index: u64) -> Ray {
    let random = &mut Random::stream(3, index);
    let [a, e, c] = mesh[1];
    let along = random.between(0.1, 0.9);
    let across = [0.0, 1.0, random.unit()][index as usize % 3];
    let target = a.lerp(e.lerp(c, across), along);
    let normal = (mesh[0][1] - mesh[0][0]).cross(mesh[2][2] - mesh[2][0]).normalize();
    let origin = target + normal * random.between(1.0, 3.0) + random.in_cube();
    ray(origin, target - origin)
}
