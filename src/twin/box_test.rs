//! Twin of `box.glsl`: conservative ray-box test. The arithmetic is the kernel's, four lanes at a time.

use glam::{Vec3, Vec4, Vec4Swizzles};

use super::exact::exact_rcp;
use super::vec::max3;
use crate::layout::Node;
use crate::layout::Ray;
use crate::shared::{BOX_SLACK, DIRECTION_FLOOR, FAR_PADDING, ORIGIN_SLACK};

/// A ray prepared for box tests: per axis `[low origin, high origin, low origin, high origin]`, so that a
/// node's four planes of an axis are measured at once, and the reciprocal direction.
#[derive(Clone, Copy, Debug)]
pub struct BoxRay {
    origin: [Vec4; 3],
    inverse: Vec3,
}

/// Prepares `ray` for boxes inside the scene's bounds.
#[inline(always)]
pub fn box_ray(ray: &Ray, scene_low: Vec3, scene_high: Vec3) -> BoxRay {
    let o = Vec3::from(ray.origin);
    let reach = max3((scene_low - o).abs()).max(max3((scene_high - o).abs()));
    let slack = Vec3::splat(reach * BOX_SLACK) + o.abs() * ORIGIN_SLACK;
    let (low, high) = (o + slack, o - slack);
    let floored = |d: f32| match d.abs() < DIRECTION_FLOOR {
        true if d < 0.0 => -DIRECTION_FLOOR,
        true => DIRECTION_FLOOR,
        false => d,
    };
    let axis = |k: usize| Vec4::new(low[k], high[k], low[k], high[k]);
    BoxRay { origin: [axis(0), axis(1), axis(2)], inverse: Vec3::from(ray.direction.map(|d| exact_rcp(floored(d)))) }
}

/// Distances at which a ray enters and leaves the two boxes of a node; lanes 0 and 2 count.
#[derive(Clone, Copy, Debug)]
pub struct Spans {
    enter: Vec4,
    leave: Vec4,
}

impl Spans {
    /// Whether the boxes of child 0 and child 1 are met.
    #[inline(always)]
    pub fn hits(&self) -> (bool, bool) {
        let mask = self.enter.cmple(self.leave).bitmask();
        (mask & 1 != 0, mask & 4 != 0)
    }

    /// Whether child 1 is entered before child 0.
    #[inline(always)]
    pub fn swapped(&self) -> bool {
        self.enter.z < self.enter.x
    }

    /// Distance at which child 0 is entered.
    #[inline(always)]
    pub fn enter0(&self) -> f32 {
        self.enter.x
    }

    /// Distance at which child 0 is left.
    #[inline(always)]
    pub fn leave0(&self) -> f32 {
        self.leave.x
    }
}

/// `box_span` of both children: `planes[axis]` is `[low 0, high 0, low 1, high 1]`.
#[inline(always)]
fn spans(ray: &BoxRay, planes: [Vec4; 3], t_min: f32, t_max: f32) -> Spans {
    let t = |k: usize| (planes[k] - ray.origin[k]) * ray.inverse[k];
    let (x, y, z) = (t(0), t(1), t(2));
    let near = x.min(x.yxwz()).max(y.min(y.yxwz())).max(z.min(z.yxwz()));
    let far = x.max(x.yxwz()).min(y.max(y.yxwz())).min(z.max(z.yxwz()));
    Spans { enter: near.max(Vec4::splat(t_min)), leave: (far * FAR_PADDING).min(Vec4::splat(t_max)) }
}

/// Spans of a node's children.
#[inline(always)]
pub fn node_spans(ray: &BoxRay, node: &Node, t_min: f32, t_max: f32) -> Spans {
    spans(ray, [Vec4::from(node.x), Vec4::from(node.y), Vec4::from(node.z)], t_min, t_max)
}

/// Spans of one box, as of two equal children.
#[inline(always)]
pub fn box_spans(ray: &BoxRay, low: Vec3, high: Vec3, t_min: f32, t_max: f32) -> Spans {
    let axis = |k: usize| Vec4::new(low[k], high[k], low[k], high[k]);
    spans(ray, [axis(0), axis(1), axis(2)], t_min, t_max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::{Hit, Triangle};
    use crate::shared::{FAR_AWAY, NO_HIT};
    use crate::twin::random::random1;
    use crate::twin::triangle::{intersect, shear_of};

    const LOW: Vec3 = Vec3::new(-1.0, 0.0, -1.0);
    const HIGH: Vec3 = Vec3::new(0.0, 0.0, 1.0);

    /// Flat, with an edge in the face x = 0 of its box.
    const TRIANGLE: Triangle =
        Triangle { v0: [0.0, 0.0, -1.0], prim: 0, v1: [0.0, 0.0, 1.0], pad1: 0, v2: [-1.0, 0.0, 0.0], pad2: 0 };

    /// Starts close to the edge and passes it outside, by 2^-28 to 2^-8 of the distance to it.
    fn ray(index: u32) -> Ray {
        let random = |dimension| random1(1, index, dimension, 0);
        let target = Vec3::Z * (random(0) - 0.5);
        let towards = Vec3::new(random(1), random(2), random(3)) * 2.0 - 1.0;
        let towards = towards * (-4.0 - 12.0 * random(4)).exp2();
        let origin = target - towards;
        let outside = Vec3::X * towards.x.abs() * (-8.0 - 20.0 * random(5)).exp2();
        Ray { origin: origin.into(), t_min: 0.0, direction: (target + outside - origin).into(), t_max: FAR_AWAY }
    }

    fn is_met(ray: &Ray, box_ray: &BoxRay) -> bool {
        let axis = |k: usize| Vec4::new(LOW[k], HIGH[k], LOW[k], HIGH[k]);
        spans(box_ray, [axis(0), axis(1), axis(2)], ray.t_min, ray.t_max).hits().0
    }

    /// The sheared coordinates of far corners are rounded, which moves an edge by a part of the triangle's size.
    /// Where the ray starts close to the edge, this is more than `FAR_PADDING` of the distance forgives.
    #[test]
    fn no_box_is_missed_whose_triangle_is_hit_and_slack_is_what_it_takes() {
        let (mut hits, mut missed_without_slack) = (0, 0);
        for ray in (0..1_000_000).map(ray) {
            let box_ray = box_ray(&ray, LOW, HIGH);
            let mut hit = Hit { t: ray.t_max, prim: NO_HIT, u: 0.0, v: 0.0 };
            intersect(&ray, &box_ray, &shear_of(ray.direction), &TRIANGLE, &mut hit);
            if hit.is_hit() {
                hits += 1;
                assert!(is_met(&ray, &box_ray), "{ray:?}");
                let without_slack = BoxRay { origin: ray.origin.map(Vec4::splat), ..box_ray };
                missed_without_slack += u32::from(!is_met(&ray, &without_slack));
            }
        }
        println!("{hits} hits, of which boxes without slack miss {missed_without_slack}");
        assert!(missed_without_slack > 0, "of {hits} hits");
    }
}
