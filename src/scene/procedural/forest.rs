//! An open forest: uneven ground, broadleaf trees, conifers, ferns and grass. Nearly all triangles are
//! thin leaves whose boxes overlap.

use super::mesh::{Builder, Vertex};
use super::noise::fractal_noise;
use super::random::Random;
use super::surface::rod;
use crate::scene::{LightKind, Scene};
use glam::{DVec3, Vec3};

/// Metres between neighbouring trees.
const SPACING: f32 = 4.5;

/// Exactly `triangles` triangles: a tenth ground, three quarters trees, the rest ferns and grass. More
/// triangles give more trees and, equally, more leaves on each.
pub fn build(triangles: usize, seed: u64) -> Scene {
    let mut builder = Builder::new("forest", triangles);
    let palette = Palette {
        bark: builder.matte("bark", [0.16, 0.10, 0.06]),
        needles: builder.matte("needles", [0.05, 0.14, 0.06]),
        leaves: builder.matte("leaves", [0.13, 0.30, 0.05]),
        fern: builder.matte("fern", [0.10, 0.26, 0.04]),
        grass: builder.matte("grass", [0.22, 0.32, 0.07]),
    };
    let soil = builder.matte("soil", [0.17, 0.12, 0.07]);

    let trees = (triangles.isqrt() / 4).max(4);
    let rows = trees.isqrt();
    let columns = trees.div_ceil(rows);
    let ground = Ground { half: SPACING * (columns as f32 * 0.5 + 1.5), seed };
    builder.sheet(soil, 1.0, triangles / 10, |u, v| ground.vertex(u, v));

    let budget = triangles * 3 / 4 / trees;
    for tree in 0..trees {
        let mut random = Random::stream(seed, tree as u64);
        let cell = [tree % columns, tree / columns].map(|i| i as f32 + random.between(0.2, 0.8));
        let root = ground.point(SPACING * (cell[0] - columns as f32 * 0.5), SPACING * (cell[1] - rows as f32 * 0.5));
        if random.unit() < 0.4 {
            conifer(&mut builder, &palette, root, budget, &mut random);
        } else {
            broadleaf(&mut builder, &palette, root, budget, &mut random);
        }
    }

    let mut random = Random::stream(seed, u64::MAX);
    let undergrowth = triangles - builder.triangles();
    let fern_triangles = (undergrowth / (4 * trees)).max(24);
    while triangles - builder.triangles() > undergrowth / 2 + fern_triangles {
        let root = ground.anywhere(&mut random);
        fern(&mut builder, &palette, root, fern_triangles, &mut random);
    }
    while builder.triangles() < triangles {
        let root = ground.anywhere(&mut random);
        grass_blade(&mut builder, &palette, root, &mut random);
    }

    let eye = ground.point(0.3 * SPACING, ground.half - 0.4) + Vec3::Y * 1.7;
    builder.camera(eye, eye + Vec3::new(-0.12, 0.16, -1.0), 55.0);
    let direction = Vec3::new(0.55, -1.0, -0.35).normalize();
    builder.light("sun", [3.2, 3.0, 2.6], LightKind::Directional { direction });
    builder.finish()
}

struct Palette {
    bark: u32,
    needles: u32,
    leaves: u32,
    fern: u32,
    grass: u32,
}

/// A height field over the square -half..half.
struct Ground {
    half: f32,
    seed: u64,
}

impl Ground {
    fn vertex(&self, u: f32, v: f32) -> Vertex {
        self.at((2.0 * u - 1.0) * self.half, (1.0 - 2.0 * v) * self.half)
    }

    fn point(&self, x: f32, z: f32) -> Vec3 {
        self.at(x, z).position
    }

    fn anywhere(&self, random: &mut Random) -> Vec3 {
        let place = random.in_cube() * self.half;
        self.point(place.x, place.z)
    }

    fn at(&self, x: f32, z: f32) -> Vertex {
        const SCALE: f64 = 0.11; // hills some 9 m across
        const HEIGHT: f64 = 0.9;
        let (height, slope) = fractal_noise(DVec3::new(f64::from(x), 0.0, f64::from(z)) * SCALE, 4, self.seed);
        let normal = DVec3::new(-slope.x * SCALE * HEIGHT, 1.0, -slope.z * SCALE * HEIGHT).normalize();
        Vertex::new(Vec3::new(x, (height * HEIGHT) as f32, z), normal.as_vec3())
    }
}

/// A trunk, bare branches, and leaves spread in balls at the branches' ends.
fn broadleaf(builder: &mut Builder, palette: &Palette, root: Vec3, budget: usize, random: &mut Random) {
    let end = builder.triangles() + budget;
    let height = random.between(5.0, 8.0);
    let lean = random.in_ball() * Vec3::new(0.5, 0.0, 0.5);
    let fork = root + lean + Vec3::Y * height * 0.45;
    let girth = 0.035 * height;
    builder.sheet(palette.bark, 2.0, (budget / 20).max(10), rod(root - Vec3::Y * 0.3, fork, [girth, girth * 0.6]));

    let branches = (budget / 40).clamp(3, 24);
    let ends: Vec<Vec3> = (0..branches)
        .map(|_| {
            let out = random.direction() * Vec3::new(0.34, 0.2, 0.34);
            fork + (out + Vec3::Y * 0.33) * height
        })
        .collect();
    for &tip in &ends {
        let share = (budget / 10 / branches).max(8);
        builder.sheet(palette.bark, 2.5, share, rod(fork, tip, [girth * 0.45, girth * 0.1]));
    }

    let leaves = end.saturating_sub(builder.triangles()) / 2;
    let ball = 0.2 * height;
    // The crown's leaf area stays the same however many leaves share it.
    let length = (2.6 * height * height / leaves.max(1) as f32).sqrt().min(0.7);
    for leaf in 0..leaves {
        let centre = ends[leaf % branches] + random.in_ball() * ball;
        blade(builder, palette.leaves, centre, random.direction(), length, length * 0.3, random);
    }
}

/// A straight trunk and whorls of drooping needle sprays, wide below and narrow on top.
fn conifer(builder: &mut Builder, palette: &Palette, root: Vec3, budget: usize, random: &mut Random) {
    let end = builder.triangles() + budget;
    let height = random.between(6.0, 10.0);
    let girth = 0.02 * height;
    let top = root + Vec3::Y * height;
    builder.sheet(palette.bark, 2.0, (budget / 15).max(10), rod(root - Vec3::Y * 0.3, top, [girth, girth * 0.1]));

    let sprays = end.saturating_sub(builder.triangles()) / 2;
    let length = (2.6 * height * height / sprays.max(1) as f32).sqrt().min(0.9);
    for _ in 0..sprays {
        // Uniform over the cone's surface: the share of sprays falls linearly with height.
        let level = 1.0 - random.unit().max(random.unit());
        let reach = (1.0 - level) * 0.2 * height;
        let (sin, cos) = super::trig::sin_cos(random.unit());
        let out = Vec3::new(sin, -0.25, cos);
        let centre = root + Vec3::Y * height * (0.15 + 0.85 * level) + out * reach * random.unit().sqrt();
        let direction = (out + random.in_ball() * 0.5).normalize();
        blade(builder, palette.needles, centre, direction, length, length * 0.15, random);
    }
}

/// Fronds that rise from the root and arch over, each a row of paired leaflets.
fn fern(builder: &mut Builder, palette: &Palette, root: Vec3, budget: usize, random: &mut Random) {
    const FRONDS: usize = 6;
    let pairs = (budget / (4 * FRONDS)).max(1);
    let spin = random.unit();
    let reach = random.between(0.4, 0.8);
    for frond in 0..FRONDS {
        let (sin, cos) = super::trig::sin_cos(spin + frond as f32 / FRONDS as f32);
        let (out, across) = (Vec3::new(sin, 0.0, cos), Vec3::new(cos, 0.0, -sin));
        for pair in 0..pairs {
            let t = (pair as f32 + 1.0) / pairs as f32;
            let centre = root + (out * t + Vec3::Y * (1.3 * t - 0.9 * t * t)) * reach;
            let length = 0.35 * reach * (1.1 - t);
            let half_width = 0.4 * reach / pairs as f32;
            for side in [across, -across] {
                let tip = (side + out * 0.4 - Vec3::Y * 0.15) * length;
                let edge = out * half_width;
                builder.quad(
                    palette.fern,
                    [centre - edge, centre + tip - edge * 0.2, centre + tip + edge * 0.2, centre + edge],
                );
            }
        }
    }
}

/// One upright triangle.
fn grass_blade(builder: &mut Builder, palette: &Palette, root: Vec3, random: &mut Random) {
    let (sin, cos) = super::trig::sin_cos(random.unit());
    let edge = Vec3::new(sin, 0.0, cos) * 0.012;
    let tip = Vec3::Y * random.between(0.1, 0.35) + random.in_ball() * 0.1;
    builder.flat_triangle(palette.grass, [root - edge, root + edge, root + tip]);
}

/// A thin diamond-shaped quadrilateral of two triangles along `direction`.
fn blade(
    builder: &mut Builder,
    material: u32,
    centre: Vec3,
    direction: Vec3,
    length: f32,
    half_width: f32,
    random: &mut Random,
) {
    let across = direction.cross(random.direction()).normalize_or(Vec3::Y) * half_width;
    let half = direction * (length * 0.5);
    builder.quad(material, [centre - half, centre + across, centre + half, centre - across]);
}
