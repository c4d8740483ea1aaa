//! The whole picture on the host, in raster order.

use super::aov::Aov;
use super::image::{Depth, Image, Samples};
use crate::Result;
use crate::layout::AovPixel;
use crate::twin::tiles::tile_pixel;

/// Colours and what the camera rays met.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    width: u32,
    height: u32,
    colors: Vec<[f32; 4]>,
    aovs: Vec<AovPixel>,
}

impl Film {
    /// A black picture.
    pub fn new(width: u32, height: u32, aovs: bool) -> Film {
        let pixels = width as usize * height as usize;
        let blank = bytemuck::Zeroable::zeroed();
        Film { width, height, colors: vec![[0.0; 4]; pixels], aovs: vec![blank; if aovs { pixels } else { 0 }] }
    }

    /// Puts a batch that begins at tile-order index `first` in its place.
    pub fn put(&mut self, first: u32, colors: &[[f32; 4]], aovs: &[AovPixel]) {
        for (i, color) in colors.iter().enumerate() {
            let (x, y) = tile_pixel(first + i as u32, self.width);
            if x < self.width && y < self.height {
                let pixel = y as usize * self.width as usize + x as usize;
                self.colors[pixel] = *color;
                if let Some(aov) = aovs.get(i) {
                    self.aovs[pixel] = *aov;
                }
            }
        }
    }

    /// Linear colour and alpha of each pixel, row-major from the top left.
    pub fn colors(&self) -> &[[f32; 4]] {
        &self.colors
    }

    /// Pixels whose colour or AOVs differ in any bit.
    pub fn differing_pixels(&self, other: &Film) -> u64 {
        let differs = |i: &usize| {
            bytemuck::bytes_of(&self.colors[*i]) != bytemuck::bytes_of(&other.colors[*i])
                || self.aovs.get(*i).map(bytemuck::bytes_of) != other.aovs.get(*i).map(bytemuck::bytes_of)
        };
        (0..self.colors.len()).filter(differs).count() as u64
    }

    /// As channels for files: R, G, B, with `alpha` A, and those of `aovs`.
    ///
    /// # Errors
    /// Those of [`Image::new`].
    pub fn image(&self, aovs: &[Aov], alpha: bool, depth: Depth) -> Result<Image> {
        let mut image = Image::new(self.width as usize, self.height as usize)?;
        let names = ["R", "G", "B", "A"];
        for (k, name) in names.iter().enumerate().take(if alpha { 4 } else { 3 }) {
            image.push(name, depth.samples(self.colors.iter().map(|c| c[k]).collect()))?;
        }
        for aov in aovs {
            for (k, name) in aov.channels().iter().enumerate() {
                image.push(name, self.channel(*aov, k))?;
            }
        }
        Ok(image)
    }

    fn channel(&self, aov: Aov, k: usize) -> Samples {
        let floats = |get: &dyn Fn(&AovPixel) -> f32| Samples::Float(self.aovs.iter().map(get).collect());
        match aov {
            Aov::Z => floats(&|p| p.z),
            Aov::N => floats(&|p| p.normal[k]),
            Aov::Albedo => floats(&|p| p.albedo[k]),
            Aov::P => floats(&|p| p.position[k]),
            Aov::PrimId => Samples::Uint(self.aovs.iter().map(|p| p.prim).collect()),
            Aov::Steps => floats(&|p| p.steps),
            Aov::Migrations => floats(&|p| p.migrations),
            Aov::Subtrees => floats(&|p| p.subtrees),
        }
    }
}
