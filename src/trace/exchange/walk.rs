//! The traversal of the reference kernel, recorded: its order of children and its rounding decide which steps a
//! ray takes, and differ from this project's own.

use super::{EdgeTriangle, Tree};
use crate::layout::{Hit, Ray};
use crate::shared::{
    LEAF_BIT, LEAF_COUNT_MASK, LEAF_COUNT_SHIFT, LEAF_FIRST_MASK, LINK_DONE, NO_HIT, STACK_SIZE, STEP_PUSHED,
};
use crate::trace::StepTrace;

/// Direction components below this magnitude are replaced by it, without their sign.
const SMALLEST_DIRECTION: f32 = 1e-20;

/// Traces `rays` as the reference kernel does and records its steps: nearer child first, the first on a tie; the
/// farther on the stack without its distance, so that a pop tests nothing; Moeller and Trumbore's triangle test
/// (1997), the first found of equal distances.
pub fn record_reference(tree: &Tree, rays: &[Ray]) -> (Vec<Hit>, StepTrace) {
    StepTrace::record(rays, |ray, steps| walk(tree, ray, steps))
}

fn walk(tree: &Tree, ray: &Ray, steps: &mut Vec<u32>) -> Hit {
    let mut hit = Hit { t: ray.t_max, prim: NO_HIT, u: 0.0, v: 0.0 };
    let inverse = ray.direction.map(|d| 1.0 / if d.abs() > SMALLEST_DIRECTION { d } else { SMALLEST_DIRECTION });
    let shifted: [f32; 3] = std::array::from_fn(|k| ray.origin[k] * inverse[k]);
    let mut stack = [LINK_DONE; STACK_SIZE as usize + 1];
    let (mut depth, mut link) = (0, 0);
    while link != LINK_DONE {
        if link & LEAF_BIT != 0 {
            steps.push(link);
            let first = (link & LEAF_FIRST_MASK) as usize;
            let count = ((link >> LEAF_COUNT_SHIFT) & LEAF_COUNT_MASK) as usize;
            for triangle in &tree.triangles[first..first + count] {
                intersect(ray, triangle, &mut hit);
            }
        } else {
            let node = link as usize;
            let spans = [0, 1].map(|child| span(&tree.planes[node], child, (shifted, inverse), (ray.t_min, hit.t)));
            let [a, b] = tree.children[node];
            let [(near_a, far_a), (near_b, far_b)] = spans;
            let (meets_a, meets_b) = (far_a >= near_a, far_b >= near_b);
            steps.push(link | if meets_a && meets_b { STEP_PUSHED } else { 0 });
            if meets_a && meets_b {
                let (first, second) = if near_b < near_a { (b, a) } else { (a, b) };
                depth += 1;
                stack[depth] = second;
                link = first;
                continue;
            }
            if meets_a || meets_b {
                link = if meets_a { a } else { b };
                continue;
            }
        }
        link = stack[depth];
        depth = depth.saturating_sub(1);
    }
    hit
}

/// Distances at which the ray enters and leaves the box of `child`.
fn span(
    planes: &[f32; 12],
    child: usize,
    (shifted, inverse): ([f32; 3], [f32; 3]),
    (t_min, t_max): (f32, f32),
) -> (f32, f32) {
    let at = |plane: usize, axis: usize| planes[plane] * inverse[axis] - shifted[axis];
    let (x, y, z) = (4 * child, 4 * child + 2, 8 + 2 * child);
    let (x0, x1, y0, y1, z0, z1) = (at(x, 0), at(x + 1, 0), at(y, 1), at(y + 1, 1), at(z, 2), at(z + 1, 2));
    let near = max(max(min(x0, x1), min(y0, y1)), max(min(z0, z1), t_min));
    let far = min(min(max(x0, x1), max(y0, y1)), min(max(z0, z1), t_max));
    (near, far)
}

/// The second only if it is greater, so that a NaN in it is passed over: Rust's own differs for NaN and zeros.
fn max(a: f32, b: f32) -> f32 {
    if a < b { b } else { a }
}

/// The second only if it is smaller.
fn min(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

fn intersect(ray: &Ray, triangle: &EdgeTriangle, hit: &mut Hit) {
    let [e1, e2] = triangle.edges;
    let q = cross(ray.direction, e2);
    let inverse = 1.0 / dot(e1, q);
    let s = std::array::from_fn(|k| ray.origin[k] - triangle.corner[k]);
    let u = dot(s, q) * inverse;
    let c = cross(s, e1);
    let v = dot(ray.direction, c) * inverse;
    let t = dot(e2, c) * inverse;
    if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > ray.t_min && t < hit.t {
        *hit = Hit { t, prim: triangle.prim, u, v };
    }
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
