//! Closed meshes, and rays from inside them that are hard to stop.

use caribou::layout::Ray;
use caribou::twin::random::pcg;
use glam::{IVec3, Vec3};

/// A mesh without holes: triangles share their corners bit for bit.
pub struct Closed {
    pub name: &'static str,
    pub positions: Vec<[Vec3; 3]>,
    /// A cube of points inside, by its middle and half its size.
    pub inside: (Vec3, f32),
}

/// Sphere, subdivided cube, and terrain in a box, `n` quads along an edge of the cube they are made of,
/// about 10 units in radius around `offset`. Corners are rounded after they are moved there.
pub fn meshes(n: i32, offset: Vec3) -> Vec<Closed> {
    let cube = move |p: IVec3| (p.as_vec3() / n as f32 * 2.0 - 1.0) * 10.0;
    let terrain = move |p: IVec3| {
        let ground = p.z == 0 && p.x > 0 && p.x < n && p.y > 0 && p.y < n;
        cube(p) + Vec3::Z * if ground { 8.0 * random(&mut pcg((p.x * 7919 + p.y) as u32)) } else { 0.0 }
    };
    let closed = |name, place: &dyn Fn(IVec3) -> Vec3, middle, half| Closed {
        name,
        positions: surface(n, &|p| place(p) + offset),
        inside: (middle + offset, half),
    };
    vec![
        closed("sphere", &|p| cube(p).normalize() * 10.0, Vec3::ZERO, 4.0),
        closed("cube", &cube, Vec3::ZERO, 9.5),
        closed("terrain in a box", &terrain, Vec3::Z * 4.0, 5.5),
    ]
}

/// The six faces of a cube of n^3 cells, each lattice point moved by `place`.
fn surface(n: i32, place: &dyn Fn(IVec3) -> Vec3) -> Vec<[Vec3; 3]> {
    let mut triangles = Vec::new();
    for axis in 0..3 {
        for side in [0, n] {
            for cell in 0..n * n {
                let at = |du: i32, dv: i32| {
                    let mut p = IVec3::ZERO;
                    p[axis] = side;
                    p[(axis + 1) % 3] = cell % n + du;
                    p[(axis + 2) % 3] = cell / n + dv;
                    place(p)
                };
                triangles.push([at(0, 0), at(1, 0), at(1, 1)]);
                triangles.push([at(0, 0), at(1, 1), at(0, 1)]);
            }
        }
    }
    triangles
}

/// The next number in 0 .. 1.
pub fn random(state: &mut u32) -> f32 {
    *state = pcg(*state);
    (*state >> 8) as f32 / (1 << 24) as f32
}

/// Ray `index`: towards a corner, a point of an edge or anywhere, or along an axis; from a point inside, in
/// one case of four in the plane of a corner.
pub fn ray(mesh: &Closed, index: u32) -> Ray {
    let state = &mut pcg(index ^ 0x5bd1_e995);
    let triangle = mesh.positions[(random(state) * mesh.positions.len() as f32) as usize % mesh.positions.len()];
    let (middle, half) = mesh.inside;
    let mut any = || Vec3::new(random(state), random(state), random(state)) * 2.0 - 1.0;
    let (mut origin, anywhere) = (middle + any() * half, any());
    let axis = (index / 32 % 3) as usize;
    if index % 4 == 3 && (triangle[0][axis] - middle[axis]).abs() < half {
        origin[axis] = triangle[0][axis];
    }
    let direction = match index % 8 {
        0..3 => triangle[0] - origin,
        3..6 => triangle[0].lerp(triangle[1], random(state)) - origin,
        6 => anywhere,
        _ => {
            // All combinations of signs of zero.
            let zero = |bit: u32| if index >> (8 + bit) & 1 == 0 { 0.0 } else { -0.0 };
            let mut d = Vec3::new(zero(0), zero(1), zero(2));
            d[axis] = if index >> 7 & 1 == 0 { 1.0 } else { -1.0 };
            d
        }
    };
    let direction = if direction.length_squared() > 0.0 { direction } else { Vec3::X };
    let direction = if (index / 8).is_multiple_of(2) { direction.normalize() } else { direction };
    Ray { origin: origin.into(), t_min: 0.0, direction: direction.into(), t_max: caribou::shared::FAR_AWAY }
}

/// Ray `index` from close to a point of an edge of the cube around the origin, and past it by 2^-28 to 2^-8 of the
/// distance: rounding in far corners moves the edge by more than all else that is rounded.
pub fn close_ray(cube: &Closed, index: u32) -> Ray {
    // Not normalised, so that it ends at the point that it is aimed at.
    let far = ray(cube, index | 8);
    let state = &mut pcg(!index);
    let aim = Vec3::from(far.origin) + Vec3::from(far.direction);
    let towards = Vec3::from(far.direction) * (-4.0 - 8.0 * random(state)).exp2();
    let past = Vec3::new(random(state), random(state), random(state)) * 2.0 - 1.0;
    let past = past * towards.length() * (-8.0 - 20.0 * random(state)).exp2();
    // Farther from the sides than the rounding error of a hit.
    let inside = 10.0 - towards.length() / 16.0;
    let origin = (aim - towards).clamp(Vec3::splat(-inside), Vec3::splat(inside));
    Ray { origin: origin.into(), direction: (aim + past - origin).into(), ..far }
}
