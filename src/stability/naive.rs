//! The usual methods, to be seen failing. Nothing else uses them.

use glam::Vec3;

use crate::bvh::{Bvh, QuantisedBvh};
use crate::fermi::contention::Stage;
use crate::layout::{Hit, Node, Ray, RayCounters};
use crate::shared::{LEAF_COUNT_MASK, LEAF_COUNT_SHIFT, LEAF_FIRST_MASK, LINK_DONE};
use crate::statistics::Estimate;
use crate::twin::trace::{missed, prepare};
use crate::twin::traverse::{is_node, met_children};
use crate::twin::triangle::intersect;

/// Möller and Trumbore 1997, as it stands in most ray tracers.
pub fn moller_trumbore(ray: &Ray, [a, b, c]: [Vec3; 3]) -> bool {
    let (origin, direction) = (Vec3::from(ray.origin), Vec3::from(ray.direction));
    let (edge1, edge2) = (b - a, c - a);
    let p = direction.cross(edge2);
    let determinant = edge1.dot(p);
    if determinant == 0.0 {
        return false;
    }
    let s = origin - a;
    let q = s.cross(edge1);
    let (u, v, t) = (s.dot(p) / determinant, direction.dot(q) / determinant, edge2.dot(q) / determinant);
    u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0
}

/// Distance along a ray of unit direction to the point that a hit's weights give.
pub fn interpolated_distance(ray: &Ray, hit: &Hit, [a, b, c]: [Vec3; 3]) -> f32 {
    let point = a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v;
    (point - Vec3::from(ray.origin)).dot(ray.direction.into())
}

/// Distance that secondary rays leave out, whatever the size of the scene.
pub const EPSILON: f32 = 1e-4;

/// The hit point as the next ray's origin, and a fixed distance left out.
pub fn fixed_epsilon(ray: &Ray, hit: &Hit, next: &Ray) -> Ray {
    let origin = Vec3::from(ray.origin) + Vec3::from(ray.direction) * hit.t;
    Ray { origin: origin.into(), t_min: EPSILON, ..*next }
}

/// The slabs of Kay and Kajiya 1986 with minimum and maximum: 0 times infinity is NaN, and rounding is not allowed for.
pub fn slabs(ray: &Ray, low: Vec3, high: Vec3) -> bool {
    let origin = Vec3::from(ray.origin);
    let inverse = Vec3::from(ray.direction).map(f32::recip);
    let (a, b) = ((low - origin) * inverse, (high - origin) * inverse);
    let (mut near, mut far) = (ray.t_min, ray.t_max);
    for k in 0..3 {
        near = near.max(a[k].min(b[k]));
        far = far.min(a[k].max(b[k]));
    }
    near <= far
}

/// The tree with planes at the nearest step of each quantised node's grid, instead of the next outwards.
pub fn nearest_steps(bvh: &Bvh) -> Bvh {
    let mut rounded = bvh.clone();
    for (node, quantised) in rounded.nodes.iter_mut().zip(&QuantisedBvh::new(bvh).nodes) {
        let Node { x, y, z, .. } = node;
        for (axis, planes) in [x, y, z].into_iter().enumerate() {
            let step = f32::from_bits((quantised.exponents >> (8 * axis) & 255) << 23);
            let origin = quantised.origin[axis];
            planes.iter_mut().for_each(|plane| *plane = origin + ((*plane - origin) / step).round() * step);
        }
    }
    rounded
}

/// Traversal with a stack of `entries`, which forgets what does not fit.
pub fn short_stack(bvh: &Bvh, ray: &Ray, entries: usize) -> Hit {
    let prepared = prepare(bvh, ray);
    let (mut hit, mut stack, mut link) = (missed(ray), Vec::new(), 0);
    while link != LINK_DONE {
        let (mut near, mut far) = (LINK_DONE, LINK_DONE);
        if is_node(link) {
            (near, far) = met_children(&bvh.nodes[link as usize], &prepared, hit.t);
        } else {
            let first = (link & LEAF_FIRST_MASK) as usize;
            let count = (link >> LEAF_COUNT_SHIFT & LEAF_COUNT_MASK) as usize;
            for triangle in &bvh.triangles[first..first + count] {
                intersect(ray, &prepared.box_ray, &prepared.shear, triangle, &mut hit);
            }
        }
        if far != LINK_DONE && stack.len() < entries {
            stack.push(far);
        }
        link = if near != LINK_DONE { near } else { stack.pop().unwrap_or(LINK_DONE) };
    }
    hit
}

/// Throughput by feeding the mean wait of M/D/1 back, a part `damping` of the old value kept each time: all values.
pub fn fixed_point(stage: &Stage, damping: f64, rounds: usize) -> Vec<f64> {
    let mut throughput = 0.0;
    (0..rounds)
        .map(|_| {
            let rho = throughput * stage.service / stage.servers;
            let wait = if rho < 1.0 { stage.service * rho / (2.0 * (1.0 - rho)) } else { f64::INFINITY };
            let next = stage.customers / (stage.think + stage.service + wait);
            throughput = damping * throughput + (1.0 - damping) * next;
            throughput
        })
        .collect()
}

/// The normal interval of single values, as if those of a cluster were independent.
pub fn independent_rays(values: &[f64]) -> Estimate {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (n - 1.0);
    let half = 1.96 * (variance / n).sqrt();
    Estimate { value: mean, interval: [mean - half, mean + half] }
}

/// As many subtrees for each SM, whatever they cost.
pub fn equal_numbers(subtrees: usize, sms: usize) -> Vec<usize> {
    (0..subtrees).map(|subtree| subtree * sms / subtrees).collect()
}

/// Node visits summed in 32 bits.
pub fn sum_u32(counters: &[RayCounters]) -> u32 {
    counters.iter().fold(0, |sum: u32, ray| sum.wrapping_add(ray.node_visits))
}
