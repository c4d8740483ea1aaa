//! Rays in, hits and counters out.

use bytemuck::{Pod, Zeroable};

/// A ray, 32 bytes. `t` is measured in units of `direction`'s length; hits with
/// `t_min <= t <= t_max` count. A *dead* ray has `t_max < t_min` and hits nothing.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Ray {
    /// Origin in world space.
    pub origin: [f32; 3],
    /// Smallest accepted t.
    pub t_min: f32,
    /// Direction, unit length from all of this project's generators.
    pub direction: [f32; 3],
    /// Largest accepted t.
    pub t_max: f32,
}

/// The nearest hit, 16 bytes; `prim` is [`crate::shared::NO_HIT`] for a miss.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Hit {
    /// Distance in units of the direction's length; the ray's `t_max` for a miss.
    pub t: f32,
    /// Primitive id.
    pub prim: u32,
    /// Barycentric weight of the second corner.
    pub u: f32,
    /// Barycentric weight of the third corner.
    pub v: f32,
}

/// What one ray did in the tree, 8 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct RayCounters {
    /// Nodes fetched.
    pub node_visits: u32,
    /// Triangles tested.
    pub triangle_tests: u32,
}
