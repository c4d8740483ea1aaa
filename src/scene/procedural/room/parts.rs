//! The list of a scene's parts and how a triangle count is spent on them.

use super::super::mesh::{Builder, Frame, Vertex};
use glam::Vec3;

type Surface = Box<dyn Fn(f32, f32) -> Vertex>;

enum Shape {
    Quad([Vec3; 4]),
    Block { frame: Frame, half: Vec3 },
    Curved { surface: Surface, aspect: f32 },
}

struct Part {
    material: u32,
    shape: Shape,
    /// The least triangles with which it still looks like itself.
    least: usize,
    /// Its share of the spare triangles, relative to the other parts. 0 for flat parts.
    weight: usize,
}

/// Parts in order of importance.
#[derive(Default)]
pub struct Parts(Vec<Part>);

impl Parts {
    /// Adds a quadrilateral of 2 triangles.
    pub fn quad(&mut self, material: u32, corners: [Vec3; 4]) {
        self.0.push(Part { material, shape: Shape::Quad(corners), least: 2, weight: 0 });
    }

    /// Adds a box of 12 triangles.
    pub fn block(&mut self, material: u32, frame: Frame, half: Vec3) {
        self.0.push(Part { material, shape: Shape::Block { frame, half }, least: 12, weight: 0 });
    }

    /// Adds a surface of at least `least` (2 or more) triangles that takes part in refinement by `weight`.
    pub fn curved(
        &mut self,
        material: u32,
        (least, weight): (usize, usize),
        aspect: f32,
        surface: impl Fn(f32, f32) -> Vertex + 'static,
    ) {
        let shape = Shape::Curved { surface: Box::new(surface), aspect };
        self.0.push(Part { material, shape, least, weight });
    }

    /// Adds the parts that fit to `builder`, in exactly `triangles` triangles. There must be a curved part
    /// among the first that fit.
    pub fn build(self, builder: &mut Builder, triangles: usize) {
        let mut spare = triangles;
        let mut fitting = self.0;
        fitting.retain(|part| {
            let fits = part.least <= spare;
            spare -= if fits { part.least } else { 0 };
            fits
        });

        let total_weight: usize = fitting.iter().map(|part| part.weight).sum();
        let share = |weight: usize| (spare as u128 * weight as u128 / total_weight.max(1) as u128) as usize;
        let mut weight_so_far = 0;
        for part in fitting {
            // Differences of rounded running sums add up to exactly `spare`.
            let extra = share(weight_so_far + part.weight) - share(weight_so_far);
            weight_so_far += part.weight;
            match part.shape {
                Shape::Quad(corners) => builder.quad(part.material, corners),
                Shape::Block { frame, half } => builder.block(part.material, &frame, half),
                Shape::Curved { surface, aspect } => {
                    builder.sheet(part.material, aspect, part.least + extra, surface);
                }
            }
        }
    }
}
