//! Closed surfaces over the sphere, without poles.

use super::mesh::{Builder, Vertex};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Triangles of [`closed_surface`] with `n` cells along each edge of the cube.
pub const fn closed_surface_triangles(n: usize) -> usize {
    12 * n * n
}

/// Adds a closed surface of `12 n^2` triangles: a cube's grid mapped to the unit sphere, each point of
/// which `surface` moves where it belongs. Vertices on the cube's edges are the same bits from both
/// faces, so the surface is watertight.
pub fn closed_surface(builder: &mut Builder, material: u32, n: usize, surface: impl Fn(DVec3) -> Vertex + Sync) {
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            let grid: Vec<Vertex> = (0..(n + 1) * (n + 1))
                .into_par_iter()
                .map(|index| {
                    let coordinate = |i: usize| 2.0 * i as f64 / n as f64 - 1.0;
                    let mut cube = DVec3::ZERO;
                    cube[axis] = sign;
                    cube[(axis + 1) % 3] = coordinate(index % (n + 1)) * sign;
                    cube[(axis + 2) % 3] = coordinate(index / (n + 1));
                    surface(sphere_from_cube(cube))
                })
                .collect();
            for cell in 0..n * n {
                let corner = cell / n * (n + 1) + cell % n;
                let [a, b, c, d] = [corner, corner + 1, corner + n + 2, corner + n + 1].map(|i| grid[i]);
                builder.triangle(material, [a, b, c]);
                builder.triangle(material, [a, c, d]);
            }
        }
    }
}

/// Adds a sphere of `12 n^2` triangles with smooth normals.
pub fn sphere(builder: &mut Builder, material: u32, centre: Vec3, radius: f32, n: usize) {
    closed_surface(builder, material, n, |unit| {
        let normal = unit.as_vec3();
        Vertex::new(centre + normal * radius, normal)
    });
}

/// Maps the surface of the cube -1..1 to the unit sphere with little distortion (P. Nowell, "Mapping a
/// cube to a sphere", 2005). Written symmetrically in the three axes, so that faces agree on their edges.
fn sphere_from_cube(p: DVec3) -> DVec3 {
    let square = p * p;
    let component = |x: f64, a: f64, b: f64| x * (1.0 - (a + b) / 2.0 + a * b / 3.0).sqrt();
    DVec3::new(
        component(p.x, square.y, square.z),
        component(p.y, square.z, square.x),
        component(p.z, square.x, square.y),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    #[test]
    fn closed_round_and_outward() {
        let n = 7;
        let mut builder = Builder::new("sphere", closed_surface_triangles(n));
        sphere(&mut builder, 0, Vec3::ZERO, 2.0, n);
        let scene = builder.finish();
        assert_eq!(scene.positions.len(), closed_surface_triangles(n));

        // Every directed edge has exactly one partner in the other direction, by the bits of its ends.
        let bits = |p: Vec3| (p + Vec3::ZERO).to_array().map(f32::to_bits);
        let mut edges: HashMap<_, i32> = HashMap::new();
        for [a, b, c] in &scene.positions {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                assert!((from.length() - 2.0).abs() < 1e-6);
                *edges.entry((bits(*from), bits(*to))).or_default() += 1;
            }
            assert!((b - a).cross(c - a).dot(*a) > 0.0);
        }
        for (from, to) in edges.keys() {
            assert_eq!((edges[&(*from, *to)], edges.get(&(*to, *from))), (1, Some(&1)));
        }
    }
}
