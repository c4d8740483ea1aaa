//! Where two pictures differ, as a picture: one number a pixel in false colours, or differences channel by channel.

use super::{absolute, flip_of};
use crate::render::false_color::{Range, from_zero, heat};
use crate::render::image::{Image, Samples};
use crate::{Error, Result};

/// How differences become one number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Metric {
    /// Root mean square over all samples.
    #[default]
    Rmse,
    /// FLIP of the displayed pictures, its mean over the pixels.
    Flip,
    /// The largest difference of any sample.
    Max,
}

impl Metric {
    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Metric::Rmse => "rmse",
            Metric::Flip => "flip",
            Metric::Max => "max",
        }
    }

    /// The difference of each pixel over all channels, NaN where a sample is NaN or infinite; `None` for FLIP without
    /// channels R, G and B.
    pub fn of_pixels(self, a: &Image, b: &Image) -> Option<Vec<f32>> {
        if self == Metric::Flip {
            return flip_of(a, b);
        }
        let mut sums = vec![0.0; a.width() * a.height()];
        for channel in a.channels() {
            for (sum, difference) in sums.iter_mut().zip(absolute(&channel.samples, b.channel(&channel.name)?)) {
                *sum = match (self, difference) {
                    (_, None) => f64::NAN,
                    (Metric::Max, Some(difference)) if sum.is_nan() || *sum > difference => *sum,
                    (Metric::Max, Some(difference)) => difference,
                    (_, Some(difference)) => *sum + difference * difference,
                };
            }
        }
        let count = a.channels().len().max(1) as f64;
        let value = |sum: f64| if self == Metric::Max { sum } else { (sum / count).sqrt() };
        Some(sums.into_iter().map(|sum| value(sum) as f32).collect())
    }
}

/// Colour of pixels with a NaN or infinite sample: none of the scale's.
const NOT_FINITE: [u8; 3] = [0, 255, 255];

/// Differences of pixels in false colours, and the scale: FLIP's is 0 to 1, the others' begins at 0 and ends at the
/// 99.5th percentile, or at the largest difference where fewer pixels differ.
pub fn false_colors(metric: Metric, differences: &[f32]) -> (Vec<[u8; 3]>, Range) {
    let range = match metric {
        Metric::Flip => Range { min: 0.0, max: 1.0 },
        Metric::Rmse | Metric::Max => {
            let range = from_zero(differences);
            let largest = differences.iter().copied().fold(0.0, f32::max);
            if range.max > 0.0 { range } else { Range { max: largest, ..range } }
        }
    };
    let color = |&value: &f32| if value.is_nan() { NOT_FINITE } else { heat(value, range) };
    (differences.iter().map(color).collect(), range)
}

/// Absolute differences under the channels' names; with R, G and B also FLIP, as channel `flip`. Where a sample is
/// NaN or infinite the difference is 0, and channel `notFinite` is 1.
///
/// # Errors
/// [`Error::Usage`] if a channel of the pictures has one of these names.
pub fn difference_image(a: &Image, b: &Image) -> Result<Image> {
    let mut image = Image::new(a.width(), a.height())?;
    let mut not_finite = vec![0.0; a.width() * a.height()];
    for channel in a.channels() {
        let Some(other) = b.channel(&channel.name) else { continue };
        let mut values = Vec::with_capacity(not_finite.len());
        for (mark, difference) in not_finite.iter_mut().zip(absolute(&channel.samples, other)) {
            // The difference of two floats of opposite signs can exceed the range of one.
            values.push(difference.unwrap_or(0.0).min(f64::from(f32::MAX)) as f32);
            *mark = if difference.is_none() { 1.0 } else { *mark };
        }
        image.push(&channel.name, Samples::Float(values))?;
    }
    let taken = |_| Error::usage("a channel is named flip or notFinite", "leave it out with --channels");
    if let Some(flip) = flip_of(a, b) {
        image.push("flip", Samples::Float(flip)).map_err(taken)?;
    }
    if not_finite.contains(&1.0) {
        image.push("notFinite", Samples::Float(not_finite)).map_err(taken)?;
    }
    Ok(image)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(r: [f32; 3], z: [f32; 3]) -> Image {
        let mut image = Image::new(3, 1).unwrap();
        image.push("R", Samples::Float(r.to_vec())).unwrap();
        image.push("Z", Samples::Float(z.to_vec())).unwrap();
        image
    }

    #[test]
    fn pixels_sum_up_their_channels() {
        let (a, b) = (image([0.0, 1.0, f32::NAN], [0.0; 3]), image([0.0, 4.0, 0.0], [0.0, -4.0, 9.0]));
        let rmse = Metric::Rmse.of_pixels(&a, &b).unwrap();
        assert_eq!(rmse[..2], [0.0, 12.5f32.sqrt()]);
        let max = Metric::Max.of_pixels(&a, &b).unwrap();
        assert_eq!(max[..2], [0.0, 4.0]);
        assert!(rmse[2].is_nan() && max[2].is_nan());
        assert_eq!(Metric::Flip.of_pixels(&a, &b), None);
        let (colors, range) = false_colors(Metric::Max, &max);
        assert_eq!((range.max, colors[2]), (4.0, NOT_FINITE));
        assert_ne!(colors[0], colors[1]);
    }

    #[test]
    fn one_differing_pixel_among_many_is_seen() {
        let mut differences = vec![0.0; 1000];
        differences[7] = 0.5;
        let (colors, range) = false_colors(Metric::Rmse, &differences);
        assert_eq!(range.max, 0.5);
        assert_ne!(colors[7], colors[8]);
    }

    #[test]
    fn difference_images_hold_finite_numbers_alone() {
        let a = image([f32::MAX, 1.0, f32::NAN], [1.0; 3]);
        let b = image([f32::MIN, 2.0, 0.0], [1.5; 3]);
        let difference = difference_image(&a, &b).unwrap();
        assert_eq!(difference.floats("R"), Some(&[f32::MAX, 1.0, 0.0][..]));
        assert_eq!(difference.floats("Z"), Some(&[0.5; 3][..]));
        assert_eq!(difference.floats("notFinite"), Some(&[0.0, 0.0, 1.0][..]));
        let again = difference_image(&image([0.0; 3], [0.0; 3]), &image([0.0; 3], [0.0; 3])).unwrap();
        assert_eq!(again.channels().len(), 2);
    }
}
