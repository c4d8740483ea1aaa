//! The whole picture on the host, in raster order.

use super::aov::Aov;
use super::image::{Depth, Image, Samples};
use super::noise::{Goal, SamplingSummary, TileSums, pixels_of};
use crate::Result;
use crate::layout::AovPixel;
use crate::shared::WARP;
use crate::twin::exact::exact_rcp;
use crate::twin::resolve::luminance;
use crate::twin::tiles::tile_count;

/// What the samples of a pass came to, for the pixels of a batch in tile order.
#[derive(Clone, Debug, Default)]
pub struct Batch {
    /// Sums of colour and alpha.
    pub sums: Vec<[f32; 4]>,
    /// Sums of squared deviations of the luminances from their mean.
    pub spreads: Vec<f32>,
    /// What the camera rays met; empty unless asked for.
    pub aovs: Vec<AovPixel>,
}

/// Colours, their spread, and what the camera rays met.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    width: u32,
    height: u32,
    /// Sums over the samples; means once finished.
    colors: Vec<[f32; 4]>,
    spreads: Vec<f32>,
    /// Samples of each tile's pixels.
    samples: Vec<u32>,
    aovs: Vec<AovPixel>,
}

impl Film {
    /// A picture without samples.
    pub fn new(width: u32, height: u32, aovs: bool) -> Film {
        let pixels = width as usize * height as usize;
        let tiles = tile_count(width, height).unwrap_or(u32::MAX) / WARP;
        Film {
            width,
            height,
            colors: vec![[0.0; 4]; pixels],
            spreads: vec![0.0; pixels],
            samples: vec![0; tiles as usize],
            aovs: vec![bytemuck::Zeroable::zeroed(); if aovs { pixels } else { 0 }],
        }
    }

    /// Pixels inside the picture of some tiles.
    pub fn pixels(&self, tiles: &[u32]) -> u64 {
        tiles.iter().map(|&tile| pixels_of(tile, (self.width, self.height)).count() as u64).sum()
    }

    /// Adds `taken` samples of the pixels of `tiles`.
    pub fn add(&mut self, tiles: &[u32], taken: u32, batch: &Batch) {
        for (slot, &tile) in tiles.iter().enumerate() {
            let before = self.samples[tile as usize];
            self.samples[tile as usize] = before + taken;
            for (lane, pixel) in pixels_of(tile, (self.width, self.height)) {
                let i = slot * WARP as usize + lane;
                self.add_pixel(pixel, (before, taken), batch.sums[i], batch.spreads[i]);
                if let Some(aov) = batch.aovs.get(i) {
                    self.aovs[pixel] = *aov;
                }
            }
        }
    }

    /// Sums add up; spreads by Chan, Golub and LeVeque 1979, equation 2.1.
    fn add_pixel(&mut self, pixel: usize, (before, taken): (u32, u32), more: [f32; 4], spread: f32) {
        let sum = &mut self.colors[pixel];
        if before == 0 {
            (*sum, self.spreads[pixel]) = (more, spread);
            return;
        }
        let (a, b) = (f64::from(before), f64::from(taken));
        let apart = f64::from(luminance(more)) / b - f64::from(luminance(*sum)) / a;
        self.spreads[pixel] += (f64::from(spread) + apart * apart * a * b / (a + b)) as f32;
        sum.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
    }

    /// Noise of a tile, as [`TileSums::noise`]; none before its second sample. Asked before [`Film::finish`].
    pub fn noise(&self, tile: u32) -> Option<f64> {
        let n = f64::from(self.samples[tile as usize]);
        let mut sums = TileSums::default();
        for (_, pixel) in pixels_of(tile, (self.width, self.height)) {
            sums.pixels += 1;
            sums.luminance += f64::from(luminance(self.colors[pixel])) / n;
            // Rounding can leave a little below 0.
            sums.squared_error += f64::from(self.spreads[pixel]).max(0.0) / (n * (n - 1.0));
        }
        (n >= 2.0).then(|| sums.noise())
    }

    /// Divides by the numbers of samples, and sums up what `goal` came to.
    pub fn finish(&mut self, goal: &Goal) -> SamplingSummary {
        let noises: Vec<Option<f64>> = (0..self.samples.len() as u32).map(|tile| self.noise(tile)).collect();
        let mut total = 0;
        for (tile, &samples) in (0..).zip(&self.samples) {
            for (_, pixel) in pixels_of(tile, (self.width, self.height)) {
                total += u64::from(samples);
                self.colors[pixel] = self.colors[pixel].map(|sum| sum * exact_rcp(samples as f32));
            }
        }
        let max = self.samples.iter().copied().max().unwrap_or(0);
        let mean = total as f64 / self.colors.len() as f64;
        let known: Vec<f64> = noises.iter().copied().flatten().collect();
        let done = |(noise, &taken): (&Option<f64>, &u32)| goal.noise.is_none() || goal.is_met(taken, *noise);
        SamplingSummary {
            mean,
            min: self.samples.iter().copied().min().unwrap_or(0),
            max,
            tiles: self.samples.len(),
            tiles_done: noises.iter().zip(&self.samples).filter(|tile| done(*tile)).count(),
            noise: (!known.is_empty()).then(|| (known.iter().map(|n| n * n).sum::<f64>() / known.len() as f64).sqrt()),
            worst_noise: known.iter().copied().reduce(f64::max),
            saved: 1.0 - mean / f64::from(max.max(1)),
        }
    }

    /// Linear colour and alpha of each pixel, row-major from the top left.
    pub fn colors(&self) -> &[[f32; 4]] {
        &self.colors
    }

    /// Pixels whose colour, number of samples or AOVs differ in any bit.
    pub fn differing_pixels(&self, other: &Film) -> u64 {
        let samples = [self, other].map(|film| film.samples_of_pixels());
        let differs = |i: &usize| {
            bytemuck::bytes_of(&self.colors[*i]) != bytemuck::bytes_of(&other.colors[*i])
                || samples[0][*i] != samples[1][*i]
                || self.aovs.get(*i).map(bytemuck::bytes_of) != other.aovs.get(*i).map(bytemuck::bytes_of)
        };
        (0..self.colors.len()).filter(differs).count() as u64
    }

    /// Samples of each pixel, row-major from the top left.
    pub fn samples_of_pixels(&self) -> Vec<u32> {
        let mut samples = vec![0; self.colors.len()];
        for (tile, &taken) in (0..).zip(&self.samples) {
            pixels_of(tile, (self.width, self.height)).for_each(|(_, pixel)| samples[pixel] = taken);
        }
        samples
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
            Aov::Samples => Samples::Float(self.samples_of_pixels().into_iter().map(|n| n as f32).collect()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GREY: f64 = 0.25;

    /// One tile of grey samples, in passes of the given lengths; pixel 0's samples alternate by +-`amplitude`.
    fn film(passes: &[u32], amplitude: f64) -> Film {
        let mut film = Film::new(8, 4, false);
        let mut first = 0;
        for &taken in passes {
            let values: Vec<f64> =
                (first..first + taken).map(|i| GREY + amplitude * f64::from(i % 2 * 2) - amplitude).collect();
            let mean = values.iter().sum::<f64>() / f64::from(taken);
            let spread = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
            let mut batch =
                Batch { sums: vec![[GREY as f32 * taken as f32; 4]; 32], spreads: vec![0.0; 32], aovs: vec![] };
            (batch.sums[0], batch.spreads[0]) = ([(mean * f64::from(taken)) as f32; 4], spread as f32);
            film.add(&[0], taken, &batch);
            first += taken;
        }
        film
    }

    #[test]
    fn noise_does_not_depend_on_passes() {
        let at_once = film(&[20], 0.1).noise(0).unwrap();
        let error = (0.01f64 * 20.0 / (20.0 * 19.0) / 32.0).sqrt();
        let expected = error * 0.5 / (GREY.sqrt() * (1.0 + GREY).powf(1.5));
        assert!((at_once - expected).abs() < 1e-6, "{at_once} is not {expected}");
        for passes in [&[1; 20][..], &[3, 7, 10], &[16, 4]] {
            let noise = film(passes, 0.1).noise(0).unwrap();
            assert!((noise - expected).abs() < 1e-6, "{passes:?}: {noise} is not {expected}");
        }
        assert_eq!((film(&[1], 0.1).noise(0), film(&[9, 9], 0.0).noise(0)), (None, Some(0.0)));
    }

    #[test]
    fn the_summary_counts_samples_and_tiles() {
        let goal = Goal { most: 64, noise: Some(0.01), seconds: None };
        let mut film = Film::new(16, 4, false);
        let batch = Batch { sums: vec![[8.0; 4]; 64], spreads: vec![0.0; 64], aovs: vec![] };
        film.add(&[0, 1], 16, &batch);
        let noisy = Batch { spreads: vec![1e3; 32], ..batch };
        film.add(&[1], 48, &noisy);
        let summary = film.finish(&goal);
        assert_eq!((summary.mean, summary.min, summary.max), (40.0, 16, 64));
        assert_eq!((summary.tiles, summary.tiles_done, summary.saved), (2, 1, 0.375));
        assert!(summary.worst_noise > summary.noise && summary.worst_noise.unwrap() > 0.01);
        assert_eq!((film.colors()[0][0], film.colors()[8][0]), (0.5, 0.25));
        assert_eq!(film.samples_of_pixels()[7..9], [16, 64]);
    }

    #[test]
    fn pixels_beyond_the_border_do_not_count() {
        let film = Film::new(9, 5, false);
        assert_eq!(film.pixels(&[0, 1, 2, 3]), 45);
        assert_eq!(film.pixels(&[3]), 1);
    }
}
