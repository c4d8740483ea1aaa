//! How noisy a picture still is, tile by tile, and when that is little enough.

use crate::shared::WARP;
use crate::twin::tiles::tile_pixel;

/// Samples before noise is judged at all. A variance from fewer is often far too small, and stopping by it darkens
/// what is seldom hit (Kirk and Arvo 1991, Unbiased Sampling Techniques for Image Synthesis); with the pixels of a
/// tile together, this many give some 500 samples.
pub const LEAST_SAMPLES: u32 = 16;

/// A tile is looked at again after a quarter more samples: few looks, and at most a fifth of the samples too many.
const GROWTH: u32 = 4;

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// Most samples a pixel.
    pub most: u32,
    /// Noise at which a tile is done.
    pub noise: Option<f32>,
    /// Seconds after which no further sample is begun; each pixel gets one.
    pub seconds: Option<f64>,
}

impl Goal {
    /// Samples to take of all tiles that are not done, which have `taken` each.
    pub fn pass(&self, taken: u32) -> u32 {
        let wanted = match (taken, self.seconds, self.noise) {
            (_, None, None) => self.most,
            (0, None, Some(_)) => LEAST_SAMPLES,
            (_, _, _) => (taken / GROWTH).max(1),
        };
        wanted.min(self.most - taken)
    }

    /// Whether the time is over after `taken` samples.
    pub fn is_late(&self, taken: u32, seconds: impl Fn() -> f64) -> bool {
        taken > 0 && self.seconds.is_some_and(|limit| seconds() >= limit)
    }

    /// Whether a tile with this noise after `taken` samples needs no more.
    pub fn is_met(&self, taken: u32, noise: Option<f64>) -> bool {
        let enough = taken >= LEAST_SAMPLES.min(self.most);
        enough && self.noise.zip(noise).is_some_and(|(target, noise)| noise <= f64::from(target))
    }
}

/// Sums over the pixels of a tile.
#[derive(Clone, Copy, Debug, Default)]
pub struct TileSums {
    /// Pixels inside the picture.
    pub pixels: u32,
    /// Their mean luminances.
    pub luminance: f64,
    /// Squared standard errors of these.
    pub squared_error: f64,
}

impl TileSums {
    /// Noise of the tile: root mean square of the standard errors of its pixels, on the scale of a display, where 1
    /// is white.
    ///
    /// A luminance L is taken to be displayed as sqrt(L / (1 + L)): the tone curve of Reinhard, Stark, Shirley and
    /// Ferwerda 2002, equation 3, and a display of gamma 2. Errors are scaled by its derivative at the tile's mean.
    /// For dark tiles that is the error over twice the square root of the brightness, as Dammertz, Hanika, Keller
    /// and Lensch 2009 (A Hierarchical Automatic Stopping Condition for Monte Carlo Global Illumination, section
    /// 2.1) measure it, who compare two halves of the samples. The variance of all samples, which is used here, is
    /// steadier, and, because the samples are spread evenly, errs to the safe side.
    pub fn noise(&self) -> f64 {
        let pixels = f64::from(self.pixels.max(1));
        let (luminance, error) = (self.luminance / pixels, (self.squared_error / pixels).sqrt());
        // Radiance is not negative: without light there is no error either.
        if error > 0.0 { error * slope(luminance) } else { 0.0 }
    }
}

/// Derivative of sqrt(L / (1 + L)).
fn slope(luminance: f64) -> f64 {
    0.5 / (luminance.sqrt() * (1.0 + luminance).powf(1.5))
}

/// Pixels of a tile that are inside a picture of `width * height`, with their places in the tile.
pub fn pixels_of(tile: u32, (width, height): (u32, u32)) -> impl Iterator<Item = (usize, usize)> {
    (0..WARP).filter_map(move |lane| {
        let (x, y) = tile_pixel(tile * WARP + lane, width);
        (x < width && y < height).then_some((lane as usize, y as usize * width as usize + x as usize))
    })
}

/// How many samples the pixels of a picture got, and what noise is left.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct SamplingSummary {
    /// Mean samples a pixel.
    pub mean: f64,
    /// Fewest.
    pub min: u32,
    /// Most.
    pub max: u32,
    /// Tiles of 8 x 4 pixels.
    pub tiles: usize,
    /// Tiles at or below the noise target; all without one.
    pub tiles_done: usize,
    /// Root mean square of the tiles' noise; none with fewer than 2 samples.
    pub noise: Option<f64>,
    /// Noise of the worst tile.
    pub worst_noise: Option<f64>,
    /// Share of camera rays saved against giving all pixels as many samples as the pixel that got most.
    pub saved: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_the_displayed_error() {
        let sums = TileSums { pixels: 32, luminance: 32.0, squared_error: 32.0 * 1e-6 };
        let displayed = |l: f64| (l / (1.0 + l)).sqrt();
        let expected = displayed(1.0 + 0.5e-3) - displayed(1.0 - 0.5e-3);
        assert!((sums.noise() - expected).abs() < 1e-8, "{} is not {expected}", sums.noise());
        assert_eq!(TileSums::default().noise(), 0.0);
        let dark = TileSums { pixels: 1, luminance: 1e-4, squared_error: 1e-12 };
        assert!((dark.noise() - 1e-6 / (2.0 * 1e-2)).abs() < 1e-8);
    }

    #[test]
    fn passes_reach_the_most_and_no_more() {
        for (noise, seconds) in [(None, None), (Some(0.1), None), (None, Some(1.0)), (Some(0.1), Some(1.0))] {
            for most in [1, 5, 16, 100] {
                let goal = Goal { most, noise, seconds };
                let (mut taken, mut passes) = (0, 0);
                while taken < most {
                    let pass = goal.pass(taken);
                    assert!(pass > 0 && (seconds.is_none() || taken > 0 || pass == 1), "{goal:?}");
                    (taken, passes) = (taken + pass, passes + 1);
                }
                assert_eq!(taken, most);
                assert!((noise, seconds) != (None, None) || passes == 1);
            }
        }
    }

    #[test]
    fn nothing_is_judged_early_or_cut_before_the_first_sample() {
        let goal = Goal { most: 100, noise: Some(0.1), seconds: Some(0.0) };
        assert!(!goal.is_met(LEAST_SAMPLES - 1, Some(0.0)) && goal.is_met(LEAST_SAMPLES, Some(0.0)));
        assert!(!goal.is_met(LEAST_SAMPLES, Some(0.2)) && !goal.is_met(LEAST_SAMPLES, None));
        assert!(Goal { most: 4, ..goal }.is_met(4, Some(0.0)));
        assert!(!goal.is_late(0, || 9.0) && goal.is_late(1, || 0.0));
        assert!(!Goal { seconds: None, ..goal }.is_late(1, || 1e9));
    }
}
