//! The pieces of furniture, each a few boxes and curved surfaces. Frames stand on the floor, their front
//! towards +z.

use super::super::mesh::{Frame, Vertex};
use super::super::random::Random;
use super::super::surface::{curtain, ellipsoid, lathe, leaf, rod};
use super::Materials;
use super::parts::Parts;
use glam::Vec3;

/// Puts furniture into the list of parts.
pub struct Furnisher<'a> {
    pub parts: &'a mut Parts,
    pub materials: &'a Materials,
    pub random: Random,
}

impl Furnisher<'_> {
    pub fn table(&mut self, frame: Frame) {
        let oak = self.materials.oak;
        self.block(oak, &frame, [0.0, 0.74, 0.0], [1.1, 0.02, 0.5]);
        for (x, z) in [(-1.0, -0.4), (1.0, -0.4), (-1.0, 0.4), (1.0, 0.4)] {
            self.block(oak, &frame, [x, 0.36, z], [0.035, 0.36, 0.035]);
        }
    }

    /// The sitter looks along the frame's -z: the back rest is at +z.
    pub fn chair(&mut self, frame: Frame) {
        let walnut = self.materials.walnut;
        for (x, z) in [(-0.19, -0.19), (0.19, -0.19), (-0.19, 0.19), (0.19, 0.19)] {
            let (foot, seat) = (frame.point(Vec3::new(x * 1.15, 0.0, z * 1.15)), frame.point(Vec3::new(x, 0.45, z)));
            self.parts.curved(walnut, (10, 1), 2.0, rod(foot, seat, [0.014, 0.022]));
        }
        self.block(walnut, &frame, [0.0, 0.46, 0.0], [0.23, 0.015, 0.23]);
        let rest = frame.shifted(Vec3::new(0.0, 0.5, 0.22));
        self.parts.curved(walnut, (16, 4), 2.0, move |u, v| {
            // A shell that wraps round the sitter and leans back.
            let x = 2.0 * u - 1.0;
            let local = Vec3::new(0.24 * x, 0.4 * v, 0.08 * v - 0.12 * x * x);
            Vertex::new(rest.point(local), rest.vector(Vec3::new(x, -0.2, 1.0)).normalize())
        });
    }

    /// A lamp that hangs from the ceiling; `centre` is its bulb's.
    pub fn pendant(&mut self, centre: Vec3, ceiling: f32) {
        let profile = [[0.24, -0.04], [0.225, 0.02], [0.16, 0.12], [0.06, 0.17], [0.02, 0.2]];
        self.parts.curved(self.materials.brass, (24, 8), 2.0, lathe(Frame::at(centre), &profile));
        let bulb = Frame::at(centre + Vec3::Y * 0.07);
        self.parts.curved(self.materials.bulb, (16, 3), 2.0, ellipsoid(bulb, Vec3::splat(0.045)));
        let cord = rod(centre + Vec3::Y * 0.19, centre.with_y(ceiling), [0.006, 0.006]);
        self.parts.curved(self.materials.walnut, (6, 1), 3.0, cord);
    }

    /// A vase, bowl or bottle of a random form, standing on `foot`.
    pub fn vessel(&mut self, foot: Vec3, radius: f32, height: f32) {
        const FORMS: [[f32; 6]; 4] = [
            [0.55, 0.90, 1.00, 0.70, 0.32, 0.45], // vase
            [0.45, 0.75, 0.90, 0.97, 1.00, 1.00], // bowl
            [0.95, 1.00, 0.98, 0.50, 0.26, 0.28], // bottle
            [0.60, 0.65, 0.80, 0.98, 1.00, 0.80], // jar
        ];
        let form = self.random.pick(&FORMS);
        let mut profile = Vec::from([[0.02 * radius, 0.0]]);
        profile.extend(form.iter().enumerate().map(|(i, r)| [r * radius, height * (0.02 + 0.196 * i as f32)]));
        let [white, celadon, terracotta] = self.materials.ceramic;
        let material = self.random.pick(&[white, celadon, terracotta, white, self.materials.brass]);
        self.parts.curved(material, (36, 10), 1.6, lathe(Frame::at(foot), &profile));
    }

    /// Seven boards, five shelves of books and vessels.
    pub fn bookcase(&mut self, frame: Frame) {
        const SHELVES: usize = 5;
        const PITCH: f32 = 0.4;
        let oak = self.materials.oak;
        let height = PITCH * SHELVES as f32;
        for x in [-0.53, 0.53] {
            self.block(oak, &frame, [x, height * 0.5, 0.0], [0.015, height * 0.5, 0.16]);
        }
        for board in 0..=SHELVES {
            let y = (board as f32 * PITCH).max(0.03);
            self.block(oak, &frame, [0.0, y, 0.0], [0.515, 0.012, 0.16]);
        }
        for shelf in 0..SHELVES {
            let floor = (shelf as f32 * PITCH).max(0.03) + 0.012;
            let mut x = -0.5;
            while x < 0.44 {
                let gap = self.random.unit();
                if gap < 0.07 && x < 0.2 {
                    let foot = frame.point(Vec3::new(x + 0.14, floor, 0.0));
                    let (radius, height) = (self.random.between(0.07, 0.12), self.random.between(0.12, 0.26));
                    self.vessel(foot, radius, height);
                    x += 0.28;
                } else {
                    x += self.book(&frame, x, floor);
                }
            }
        }
    }

    /// A book that stands with its left side at `x`; returns the room it takes.
    fn book(&mut self, frame: &Frame, x: f32, floor: f32) -> f32 {
        let half = Vec3::new(
            self.random.between(0.009, 0.024),
            self.random.between(0.085, 0.15),
            self.random.between(0.07, 0.11),
        );
        let cover = self.random.pick(&self.materials.books);
        let centre = Vec3::new(x + half.x, floor + half.y, 0.13 - half.z);
        self.parts.block(cover, frame.shifted(centre), half);
        2.0 * half.x + 0.001
    }

    pub fn sofa(&mut self, frame: Frame) {
        let [linen, wool, ochre] = self.materials.cloth;
        self.block(wool, &frame, [0.0, 0.2, 0.0], [1.0, 0.12, 0.42]);
        self.block(wool, &frame, [0.0, 0.5, -0.36], [1.0, 0.3, 0.09]);
        for x in [-1.06, 1.06] {
            self.block(wool, &frame, [x, 0.32, 0.0], [0.09, 0.26, 0.44]);
        }
        for x in [-0.49, 0.49] {
            let seat = frame.shifted(Vec3::new(x, 0.38, 0.06));
            self.parts.curved(linen, (48, 16), 1.5, ellipsoid(seat, Vec3::new(0.5, 0.11, 0.4)));
        }
        for (x, cloth) in [(-0.72, ochre), (0.7, linen)] {
            let pillow = frame.shifted(Vec3::new(x, 0.62, -0.16));
            self.parts.curved(cloth, (48, 12), 1.5, ellipsoid(pillow, Vec3::new(0.24, 0.22, 0.1)));
        }
    }

    /// A woven rug, its threads a fine relief.
    pub fn rug(&mut self, centre: Vec3, half_x: f32, half_z: f32) {
        self.parts.curved(self.materials.cloth[2], (2, 30), half_x / half_z, move |u, v| {
            let (weft, _) = super::super::trig::sin_cos(u * 120.0);
            let (warp, _) = super::super::trig::sin_cos(v * 90.0);
            let local = Vec3::new((2.0 * u - 1.0) * half_x, 0.003 * weft * warp, (1.0 - 2.0 * v) * half_z);
            Vertex::new(centre + local, Vec3::Y)
        });
    }

    /// A pair of curtains beside a window, `half` metres either side of `middle`.
    pub fn curtains(&mut self, middle: Vec3, half: f32) {
        for side in [-half, half] {
            let frame = Frame::at(middle + Vec3::X * side);
            self.parts.curved(self.materials.cloth[0], (60, 20), 6.0, curtain(frame, 0.35, 2.4, 7.0));
        }
    }

    /// A framed wall mirror that faces +x.
    pub fn mirror(&mut self, centre: Vec3) {
        let frame = Frame::turned(centre, 0.25);
        self.block(self.materials.walnut, &frame, [0.0, 0.0, 0.0], [0.62, 0.47, 0.012]);
        self.block(self.materials.mirror, &frame, [0.0, 0.0, 0.012], [0.57, 0.42, 0.005]);
    }

    /// A pot with `leaves` long leaves.
    pub fn plant(&mut self, foot: Vec3, leaves: usize) {
        let pot = [[0.02, 0.0], [0.15, 0.01], [0.19, 0.2], [0.21, 0.36], [0.2, 0.38]];
        self.parts.curved(self.materials.ceramic[2], (36, 8), 1.6, lathe(Frame::at(foot), &pot));
        for _ in 0..leaves {
            let out = self.random.direction() * Vec3::new(1.0, 0.0, 1.0);
            let up = (out * self.random.between(0.1, 0.7) + Vec3::Y).normalize();
            // The blade's face, and with it its bend, points outwards.
            let x = up.cross(out).normalize_or(Vec3::X);
            let frame = Frame { origin: foot + Vec3::Y * 0.36 + out * 0.1, axes: [x, up, x.cross(up)] };
            let blade = leaf(frame, self.random.between(0.4, 1.1), 0.03, self.random.between(0.1, 0.5));
            self.parts.curved(self.materials.plant, (4, 2), 0.3, blade);
        }
    }

    /// Plates, glasses and fruit for four.
    pub fn set_table(&mut self, top: Vec3) {
        let plate = [[0.01, 0.0], [0.07, 0.003], [0.1, 0.012], [0.13, 0.022]];
        let glass = [[0.004, 0.0], [0.03, 0.002], [0.036, 0.05], [0.038, 0.11]];
        for (x, z) in [(-0.55, -0.28), (0.55, -0.28), (-0.55, 0.28), (0.55, 0.28)] {
            let seat = top + Vec3::new(x, 0.001, z);
            self.parts.curved(self.materials.ceramic[0], (36, 6), 2.5, lathe(Frame::at(seat), &plate));
            let right = Frame::at(seat + Vec3::new(0.17, 0.0, -0.12 * z.signum()));
            self.parts.curved(self.materials.glass, (30, 6), 1.6, lathe(right, &glass));
        }
        for fruit in 0..5 {
            let (sin, cos) = super::super::trig::sin_cos(fruit as f32 / 5.0);
            let frame = Frame::at(top + Vec3::new(-0.22 + 0.07 * cos, 0.038, 0.07 * sin));
            self.parts.curved(self.materials.cloth[2], (30, 4), 1.6, ellipsoid(frame, Vec3::splat(0.038)));
        }
    }

    pub fn floor_lamp(&mut self, foot: Vec3) {
        let base = [[0.16, 0.0], [0.155, 0.02], [0.03, 0.03], [0.012, 0.06]];
        self.parts.curved(self.materials.brass, (24, 4), 2.0, lathe(Frame::at(foot), &base));
        let stem = rod(foot + Vec3::Y * 0.05, foot + Vec3::Y * 1.5, [0.012, 0.012]);
        self.parts.curved(self.materials.brass, (10, 1), 2.0, stem);
        let shade = rod(foot + Vec3::Y * 1.4, foot + Vec3::Y * 1.72, [0.24, 0.16]);
        self.parts.curved(self.materials.cloth[0], (20, 6), 3.0, shade);
    }

    fn block(&mut self, material: u32, frame: &Frame, centre: [f32; 3], half: [f32; 3]) {
        self.parts.block(material, frame.shifted(Vec3::from(centre)), Vec3::from(half));
    }
}
