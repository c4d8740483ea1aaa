//! Parametric surfaces for [`Builder::sheet`](super::mesh::Builder::sheet): functions of (u, v) in the
//! unit square whose normal is on the side from which u to v turns counter-clockwise.

use super::mesh::{Frame, Vertex};
use super::trig::sin_cos;
use glam::{Vec2, Vec3};

/// A flat rectangle in the frame's x-z plane, its normal along the frame's +y; (u, v) are texture
/// coordinates.
pub fn rectangle(frame: Frame, half_x: f32, half_z: f32) -> impl Fn(f32, f32) -> Vertex + Copy {
    move |u, v| Vertex {
        position: frame.point(Vec3::new((2.0 * u - 1.0) * half_x, 0.0, (1.0 - 2.0 * v) * half_z)),
        normal: frame.axes[1],
        uv: Vec2::new(u, 1.0 - v),
    }
}

/// A surface of revolution about the frame's y axis. `profile` lists (radius, height) from the bottom
/// of the outside upwards, at least 2 points; a Catmull-Rom spline runs through them.
pub fn lathe(frame: Frame, profile: &[[f32; 2]]) -> impl Fn(f32, f32) -> Vertex + use<> {
    let profile: Vec<Vec2> = profile.iter().map(|&point| Vec2::from(point)).collect();
    move |u, v| {
        let (point, tangent) = catmull_rom(&profile, v);
        let (sin, cos) = sin_cos(u);
        let out = Vec2::new(tangent.y, -tangent.x).normalize_or(Vec2::X);
        Vertex::new(
            frame.point(Vec3::new(point.x * cos, point.y, -point.x * sin)),
            frame.vector(Vec3::new(out.x * cos, out.y, -out.x * sin)).normalize(),
        )
    }
}

/// An ellipsoid with the given half extents. Pin-hole openings at the poles keep every triangle's area
/// above zero.
pub fn ellipsoid(frame: Frame, half: Vec3) -> impl Fn(f32, f32) -> Vertex + Copy {
    const POLE: f32 = 0.005;
    move |u, v| {
        let (sin, cos) = sin_cos(u);
        let (height, radius) = sin_cos(0.5 * (POLE + v * (1.0 - 2.0 * POLE)) - 0.25);
        let unit = Vec3::new(radius * cos, height, -radius * sin);
        Vertex::new(frame.point(unit * half), frame.vector(unit / half).normalize())
    }
}

/// A tapered rod from `from` to `to`, open at its ends.
pub fn rod(from: Vec3, to: Vec3, radii: [f32; 2]) -> impl Fn(f32, f32) -> Vertex + Copy {
    let axis = to - from;
    let frame = Frame::along(from, axis.normalize_or(Vec3::Y));
    move |u, v| {
        let (sin, cos) = sin_cos(u);
        let out = frame.axes[0] * cos - frame.axes[2] * sin;
        Vertex::new(from + axis * v + out * (radii[0] + (radii[1] - radii[0]) * v), out)
    }
}

/// A curtain of `folds` waves hanging in the frame's x-y plane, its front towards +z.
pub fn curtain(frame: Frame, half_width: f32, height: f32, folds: f32) -> impl Fn(f32, f32) -> Vertex + Copy {
    move |u, v| {
        let depth = 0.25 * half_width / folds * (1.0 + 0.5 * (1.0 - v)); // deeper towards the hem
        let (sin, cos) = sin_cos(u * folds);
        let slope = depth * cos * folds * std::f32::consts::TAU / (2.0 * half_width);
        let position = frame.point(Vec3::new((2.0 * u - 1.0) * half_width, v * height, depth * sin));
        Vertex::new(position, frame.vector(Vec3::new(-slope, 0.0, 1.0)).normalize())
    }
}

/// A leaf blade from the frame's origin along its +y, tapered at both ends and bent towards +z by
/// `bend` times its length; its face towards +z.
pub fn leaf(frame: Frame, length: f32, half_width: f32, bend: f32) -> impl Fn(f32, f32) -> Vertex + Copy {
    move |u, v| {
        let taper = 0.08 + 3.68 * v * (1.0 - v); // 1 in the middle, 0.08 at both ends
        let local = Vec3::new((2.0 * u - 1.0) * half_width * taper, length * v, length * bend * v * v);
        Vertex::new(frame.point(local), frame.vector(Vec3::new(0.0, -2.0 * bend * v, 1.0)).normalize())
    }
}

/// Point and tangent at `t` in 0..=1 of the Catmull-Rom spline through `points`, evenly spaced in t; the
/// end points count twice.
fn catmull_rom(points: &[Vec2], t: f32) -> (Vec2, Vec2) {
    let last = points.len() - 1;
    let position = t * last as f32;
    let index = (position as usize).min(last.saturating_sub(1));
    let s = position - index as f32;
    let [p0, p1, p2, p3] =
        [index.saturating_sub(1), index, (index + 1).min(last), (index + 2).min(last)].map(|i| points[i]);
    let (a, b, c) = (3.0 * (p1 - p2) + p3 - p0, 2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3, p2 - p0);
    (p1 + 0.5 * s * (c + s * (b + s * a)), 0.5 * (c + s * (2.0 * b + s * 3.0 * a)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The normal agrees with the cross product of central differences along u and v.
    fn assert_consistent(name: &str, surface: impl Fn(f32, f32) -> Vertex) {
        let h = 1e-3;
        for (u, v) in [(0.13, 0.21), (0.52, 0.47), (0.81, 0.9), (0.3, 0.62)] {
            let du = surface(u + h, v).position - surface(u - h, v).position;
            let dv = surface(u, v + h).position - surface(u, v - h).position;
            let cosine = du.cross(dv).normalize().dot(surface(u, v).normal);
            assert!(cosine > 0.9, "{name} at {u} {v}: cosine {cosine}");
        }
    }

    #[test]
    fn normals_face_the_front() {
        let frame = Frame::turned(Vec3::new(1.0, -2.0, 0.5), 0.2);
        assert_consistent("rectangle", rectangle(frame, 2.0, 1.0));
        assert_consistent("lathe", lathe(frame, &[[0.5, 0.0], [0.8, 0.4], [0.3, 0.9], [0.4, 1.2]]));
        assert_consistent("ellipsoid", ellipsoid(frame, Vec3::new(0.5, 0.3, 0.9)));
        assert_consistent("rod", rod(Vec3::ZERO, Vec3::new(1.0, 2.0, 0.5), [0.2, 0.1]));
        assert_consistent("curtain", curtain(frame, 0.6, 2.0, 5.0));
        assert_consistent("leaf", leaf(frame, 0.4, 0.05, 0.3));
    }

    #[test]
    fn surfaces_of_revolution_close() {
        let frame = Frame::at(Vec3::ZERO);
        let vase = lathe(frame, &[[0.5, 0.0], [0.8, 0.4], [0.3, 0.9]]);
        for v in [0.0, 0.3, 1.0] {
            assert_eq!(vase(0.0, v), vase(1.0, v));
            let ball = ellipsoid(frame, Vec3::ONE);
            assert_eq!(ball(0.0, v), ball(1.0, v));
        }
    }
}
