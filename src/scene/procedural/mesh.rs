//! The builder that all recipes share: triangles with normals go in, a [`Scene`] comes out.

use crate::scene::{Camera, Light, LightKind, Material, Projection, Scene, floored};
use glam::{Mat4, Vec2, Vec3};

/// A corner of a triangle, or a point of a parametric surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// World position, metres.
    pub position: Vec3,
    /// Unit shading normal.
    pub normal: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
}

impl Vertex {
    /// A vertex of a surface without texture.
    pub fn new(position: Vec3, normal: Vec3) -> Self {
        Vertex { position, normal, uv: Vec2::ZERO }
    }
}

/// A right-handed orthonormal coordinate frame.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// World position of the frame's origin.
    pub origin: Vec3,
    /// World directions of its axes.
    pub axes: [Vec3; 3],
}

impl Frame {
    /// World axes at `origin`.
    pub fn at(origin: Vec3) -> Self {
        Frame { origin, axes: [Vec3::X, Vec3::Y, Vec3::Z] }
    }

    /// World axes at `origin`, turned about +y by a fraction of a full turn (from +z towards +x).
    pub fn turned(origin: Vec3, turns: f32) -> Self {
        let (sin, cos) = super::trig::sin_cos(turns);
        Frame { origin, axes: [Vec3::new(cos, 0.0, -sin), Vec3::Y, Vec3::new(sin, 0.0, cos)] }
    }

    /// A frame at `origin` whose +y points along the unit vector `up`.
    pub fn along(origin: Vec3, up: Vec3) -> Self {
        let helper = if up.x.abs() < 0.8 { Vec3::X } else { Vec3::Z };
        let z = helper.cross(up).normalize();
        Frame { origin, axes: [up.cross(z), up, z] }
    }

    /// The same axes with the origin moved to a local point.
    pub fn shifted(&self, local: Vec3) -> Self {
        Frame { origin: self.point(local), ..*self }
    }

    /// World position of a local point.
    pub fn point(&self, local: Vec3) -> Vec3 {
        self.origin + self.vector(local)
    }

    /// World direction of a local one.
    pub fn vector(&self, local: Vec3) -> Vec3 {
        self.axes[0] * local.x + self.axes[1] * local.y + self.axes[2] * local.z
    }
}

/// Collects triangles, materials, cameras and lights.
pub struct Builder {
    scene: Scene,
    textured: bool,
    smooth: bool,
}

impl Builder {
    /// A scene of about `triangles` triangles with normals and without texture coordinates.
    pub fn new(name: &str, triangles: usize) -> Self {
        Self::with_attributes(name, triangles, true, false)
    }

    /// A scene that holds normals if `smooth` and texture coordinates if `textured`.
    pub fn with_attributes(name: &str, triangles: usize, smooth: bool, textured: bool) -> Self {
        let scene = Scene {
            name: name.to_owned(),
            positions: Vec::with_capacity(triangles),
            material_ids: Vec::with_capacity(triangles),
            normals: Vec::with_capacity(if smooth { triangles } else { 0 }),
            uvs: Vec::with_capacity(if textured { triangles } else { 0 }),
            ..Scene::default()
        };
        Builder { scene, textured, smooth }
    }

    /// Triangles so far.
    pub fn triangles(&self) -> usize {
        self.scene.positions.len()
    }

    /// The finished scene.
    pub fn finish(self) -> Scene {
        self.scene
    }

    /// Adds a material and returns its index.
    pub fn material(&mut self, name: &str, material: Material) -> u32 {
        self.scene.materials.push(Material { name: Some(name.to_owned()), ..material });
        self.scene.materials.len() as u32 - 1
    }

    /// Adds a matte material of a linear colour.
    pub fn matte(&mut self, name: &str, base_color: [f32; 3]) -> u32 {
        self.material(name, Material { base_color, ..Material::default() })
    }

    /// Adds a texture and returns its index.
    pub fn texture(&mut self, texture: crate::scene::Texture) -> u32 {
        self.scene.textures.push(texture);
        self.scene.textures.len() as u32 - 1
    }

    /// Adds the camera `main` at `eye`, looking at `target`; `yfov_degrees` is the full vertical angle.
    pub fn camera(&mut self, eye: Vec3, target: Vec3, yfov_degrees: f32) {
        let back = (eye - target).normalize();
        let right = Vec3::Y.cross(back).normalize();
        let up = back.cross(right);
        self.scene.cameras.push(Camera {
            name: Some("main".to_owned()),
            world_from_camera: Mat4::from_cols(right.extend(0.0), up.extend(0.0), back.extend(0.0), eye.extend(1.0)),
            projection: Projection::Perspective { yfov: yfov_degrees * (std::f32::consts::PI / 180.0) },
        });
    }

    /// Adds a light; `intensity` in candela (point, spot) or lux (directional), linear colour included.
    pub fn light(&mut self, name: &str, intensity: [f32; 3], kind: LightKind) {
        self.scene.lights.push(Light { name: Some(name.to_owned()), intensity, kind });
    }

    /// Adds a triangle, counter-clockwise seen from outside.
    pub fn triangle(&mut self, material: u32, corners: [Vertex; 3]) {
        self.scene.positions.push(corners.map(|c| floored(c.position)));
        self.scene.material_ids.push(material);
        if self.smooth {
            self.scene.normals.push(corners.map(|c| c.normal));
        }
        if self.textured {
            self.scene.uvs.push(corners.map(|c| c.uv));
        }
    }

    /// Adds a flat triangle, counter-clockwise seen from outside.
    pub fn flat_triangle(&mut self, material: u32, corners: [Vec3; 3]) {
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
        self.triangle(material, corners.map(|corner| Vertex::new(corner, normal)));
    }

    /// Adds a flat quadrilateral as two triangles, counter-clockwise seen from outside.
    pub fn quad(&mut self, material: u32, corners: [Vec3; 4]) {
        let [a, b, c, d] = corners;
        let normal = (c - a).cross(d - b).normalize_or(Vec3::Y);
        let [a, b, c, d] = corners.map(|corner| Vertex::new(corner, normal));
        self.triangle(material, [a, b, c]);
        self.triangle(material, [a, c, d]);
    }

    /// Adds a box of 12 triangles about the frame's origin; `half` are its half extents.
    pub fn block(&mut self, material: u32, frame: &Frame, half: Vec3) {
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                let mut out = Vec3::ZERO;
                out[axis] = half[axis] * sign;
                let (mut u, mut v) = (Vec3::ZERO, Vec3::ZERO);
                u[(axis + 1) % 3] = half[(axis + 1) % 3] * sign;
                v[(axis + 2) % 3] = half[(axis + 2) % 3];
                self.quad(material, [out - u - v, out + u - v, out + u + v, out - u + v].map(|p| frame.point(p)));
            }
        }
    }

    /// Adds a parametric surface over the unit square in exactly `count` triangles (at least 2).
    ///
    /// The grid has about `aspect` times as many columns (u) as rows (v). What is left over is spent
    /// on cells of the first row: four triangles about the cell's centre instead of two, and, for an odd
    /// count, one cell whose edge on the border v = 0 is split. No edge inside is split, so the surface
    /// stays closed.
    pub fn sheet(&mut self, material: u32, aspect: f32, count: usize, surface: impl Fn(f32, f32) -> Vertex) {
        let cells = (count / 2).max(1);
        let columns = ((cells as f32 * aspect).sqrt().round() as usize).clamp(1, cells);
        let rows = cells / columns;
        let spare = count.saturating_sub(2 * columns * rows); // below 2 * columns
        let (centred, split) = (spare / 2, spare % 2 == 1);

        let at = |column: f32, row: f32| surface(column / columns as f32, row / rows as f32);
        let line = |row: usize| (0..=columns).map(|column| at(column as f32, row as f32)).collect::<Vec<_>>();
        let mut below = line(0);
        for row in 0..rows {
            let above = line(row + 1);
            for column in 0..columns {
                let [a, b, c, d] = [below[column], below[column + 1], above[column + 1], above[column]];
                if row == 0 && column < centred {
                    let centre = at(column as f32 + 0.5, 0.5);
                    for [from, to] in [[a, b], [b, c], [c, d], [d, a]] {
                        self.triangle(material, [from, to, centre]);
                    }
                } else if row == 0 && split && column + 1 == columns {
                    let middle = at(column as f32 + 0.5, 0.0);
                    for [from, to] in [[b, c], [c, d], [d, a]] {
                        self.triangle(material, [from, to, middle]);
                    }
                } else {
                    self.triangle(material, [a, b, c]);
                    self.triangle(material, [a, c, d]);
                }
            }
            below = above;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[Vec3; 3]) -> f32 {
        (corners[1] - corners[0]).cross(corners[2] - corners[0]).length() * 0.5
    }

    #[test]
    fn sheets_have_exactly_the_asked_count_and_cover_the_square_once() {
        for count in 2..400 {
            for aspect in [0.1, 1.0, 7.0] {
                let mut builder = Builder::new("sheet", count);
                builder.sheet(0, aspect, count, |u, v| Vertex::new(Vec3::new(u, v, 0.0), Vec3::Z));
                let scene = builder.finish();
                assert_eq!(scene.positions.len(), count, "aspect {aspect}");
                let total: f32 = scene.positions.iter().map(area).sum();
                assert!((total - 1.0).abs() < 1e-4, "count {count} aspect {aspect}: area {total}");
                assert!(
                    scene.positions.iter().all(|[a, b, c]| (b - a).cross(c - a).z > 0.0),
                    "count {count}: a triangle faces backwards"
                );
            }
        }
    }

    #[test]
    fn block_faces_outwards() {
        let frame = Frame::turned(Vec3::new(1.0, 2.0, 3.0), 0.1);
        let mut builder = Builder::new("block", 12);
        builder.block(0, &frame, Vec3::new(0.5, 1.0, 2.0));
        let scene = builder.finish();
        assert_eq!(scene.positions.len(), 12);
        for ([a, b, c], normals) in scene.positions.iter().zip(&scene.normals) {
            let geometric = (b - a).cross(c - a);
            assert!(geometric.dot(*a - frame.origin) > 0.0);
            assert!(geometric.normalize().dot(normals[0]) > 0.999);
        }
        let total: f32 = scene.positions.iter().map(area).sum();
        assert!((total - 2.0 * (2.0 + 4.0 + 8.0)).abs() < 1e-4, "{total}");
    }

    #[test]
    fn frames_are_right_handed_and_orthonormal() {
        let frames = [
            Frame::turned(Vec3::ZERO, 0.37),
            Frame::along(Vec3::ZERO, Vec3::X),
            Frame::along(Vec3::ZERO, Vec3::new(0.6, 0.0, -0.8)),
        ];
        for Frame { axes: [x, y, z], .. } in frames {
            assert!(x.cross(y).distance(z) < 1e-6 && (x.length() - 1.0).abs() < 1e-6);
        }
    }
}
