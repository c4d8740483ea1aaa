//! Welds equal triangle corners into shared vertices, for writing indexed meshes.

use crate::scene::Scene;
use xxhash_rust::xxh3::xxh3_64;

/// An indexed mesh over the corners of a scene. Corner `3 t + k` is corner `k` of triangle `t`.
#[derive(Debug)]
pub struct Welded {
    /// Three vertex indices a triangle, in the order of the triangles given.
    pub indices: Vec<u32>,
    /// For each vertex the first corner that it stands for.
    pub first_corners: Vec<u32>,
}

/// Position, normal and texture coordinates of a corner; what is absent is zero.
type Key = [u32; 8];

/// Welds the corners of `triangles` that agree in position, normal and, if `textured`, texture
/// coordinates. Vertices come in order of first use. The caller makes sure that corners fit 32 bits.
pub fn weld(scene: &Scene, triangles: &[u32], textured: bool) -> Welded {
    let corners = triangles.len() * 3;
    let mut welded = Welded { indices: Vec::with_capacity(corners), first_corners: Vec::new() };

    // Open addressing over vertex indices: 4 bytes a slot, where a HashMap of keys would take 36.
    let mut slots = vec![EMPTY; (corners + corners / 2).next_power_of_two()];
    let mask = slots.len() - 1;
    for corner in triangles.iter().flat_map(|t| (0..3).map(move |k| 3 * t + k)) {
        let key = key(scene, corner, textured);
        let mut slot = xxh3_64(bytemuck::bytes_of(&key)) as usize & mask;
        loop {
            let vertex = slots[slot];
            if vertex == EMPTY {
                slots[slot] = welded.first_corners.len() as u32;
                welded.indices.push(slots[slot]);
                welded.first_corners.push(corner);
                break;
            }
            if self::key(scene, welded.first_corners[vertex as usize], textured) == key {
                welded.indices.push(vertex);
                break;
            }
            slot = (slot + 1) & mask;
        }
    }
    welded
}

const EMPTY: u32 = u32::MAX;

fn key(scene: &Scene, corner: u32, textured: bool) -> Key {
    let (triangle, k) = (corner as usize / 3, corner as usize % 3);
    let mut key = [0.0f32; 8];
    key[..3].copy_from_slice(&scene.positions[triangle][k].to_array());
    if let Some(normals) = scene.normals.get(triangle) {
        key[3..6].copy_from_slice(&normals[k].to_array());
    }
    if textured && let Some(uvs) = scene.uvs.get(triangle) {
        key[6..].copy_from_slice(&uvs[k].to_array());
    }
    key.map(|component| (component + 0.0).to_bits()) // -0.0 + 0.0 is 0.0: both zeros weld
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Vec2, Vec3};

    /// Two triangles that share an edge, one zero of which has the other sign.
    fn pair() -> Scene {
        let [a, b, c, d] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| Vec3::new(x, y, 0.0));
        Scene { positions: vec![[a, b, c], [Vec3::new(-0.0, 0.0, -0.0), c, d]], ..Scene::default() }
    }

    #[test]
    fn shared_corners_weld() {
        let welded = weld(&pair(), &[0, 1], false);
        assert_eq!(welded.indices, [0, 1, 2, 0, 2, 3]);
        assert_eq!(welded.first_corners, [0, 1, 2, 5]);
    }

    #[test]
    fn corners_that_differ_in_normal_or_texture_stay_apart() {
        let mut scene = pair();
        scene.normals = vec![[Vec3::Z; 3], [Vec3::X; 3]];
        assert_eq!(weld(&scene, &[0, 1], false).first_corners.len(), 6);

        let mut scene = pair();
        scene.uvs = vec![[Vec2::ZERO; 3], [Vec2::ONE; 3]];
        assert_eq!(weld(&scene, &[0, 1], true).first_corners.len(), 6);
        assert_eq!(weld(&scene, &[0, 1], false).first_corners.len(), 4, "uvs count only where they are written");
    }

    #[test]
    fn no_triangles_no_vertices() {
        assert!(weld(&Scene::default(), &[], false).indices.is_empty());
    }
}
