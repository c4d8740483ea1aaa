//! How far two pictures are apart: root mean square and largest difference of each channel, and FLIP of what a screen
//! shows.

mod color;
mod filter;
mod flip;
pub mod picture;

use super::image::{Image, Samples};
use super::tone::display;
use crate::{Error, Result};

pub use flip::flip;

/// Differences of a channel. Samples of which either is NaN or infinite are counted, and left out of all else.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct ChannelDifference {
    /// OpenEXR name; `all` for all channels together.
    pub channel: String,
    /// Root of the mean square of the differences.
    pub rmse: f64,
    /// Largest difference, without its sign.
    pub max: f64,
    /// Pixel of the largest difference, from the top left; none if there is no difference.
    pub max_at: Option<[usize; 2]>,
    /// Samples that differ, NaN and infinite ones included.
    pub differing: u64,
    /// NaN or infinite samples of the first picture, and of the second.
    pub not_finite: [u64; 2],
    /// Samples compared.
    pub samples: u64,
}

/// Says why two pictures cannot be compared, if they cannot.
///
/// # Errors
/// [`Error::Usage`] with the sizes or the channels that only one of them has.
pub fn check_comparable(a: &Image, b: &Image) -> Result<()> {
    let size = |image: &Image| format!("{} x {}", image.width(), image.height());
    if size(a) != size(b) {
        let what = format!("the pictures differ in size: {} and {} pixels", size(a), size(b));
        return Err(Error::usage(what, "compare pictures of one size"));
    }
    let missing = |a: &Image, b: &Image| -> Vec<String> {
        let names = a.channels().iter().map(|channel| channel.name.clone());
        names.filter(|name| b.channel(name).is_none()).collect()
    };
    let list = |names: Vec<String>| if names.is_empty() { "none".to_owned() } else { names.join(", ") };
    let (first, second) = (missing(a, b), missing(b, a));
    if first.is_empty() && second.is_empty() {
        return Ok(());
    }
    let what = format!("channels of the first picture alone: {}, of the second alone: {}", list(first), list(second));
    Err(Error::usage(what, "compare pictures of the same channels, or name common ones with --channels"))
}

/// Differences of each channel, in the first picture's order. The pictures are of one size, and the second has the
/// first one's channels.
pub fn channel_differences(a: &Image, b: &Image) -> Vec<ChannelDifference> {
    let compared = a.channels().iter().filter_map(|channel| {
        let other = b.channel(&channel.name)?;
        Some(channel_difference(&channel.name, a.width(), (&channel.samples, other)))
    });
    compared.collect()
}

fn channel_difference(name: &str, width: usize, (a, b): (&Samples, &Samples)) -> ChannelDifference {
    let mut found = ChannelDifference { channel: name.to_owned(), ..ChannelDifference::default() };
    let mut squares = 0.0;
    for (i, (a, b)) in numbers(a).zip(numbers(b)).enumerate() {
        found.not_finite[0] += u64::from(!a.is_finite());
        found.not_finite[1] += u64::from(!b.is_finite());
        found.differing += u64::from(a != b);
        let Some(difference) = finite_difference(a, b) else { continue };
        found.samples += 1;
        squares += difference * difference;
        if difference > found.max {
            (found.max, found.max_at) = (difference, Some([i % width, i / width]));
        }
    }
    found.rmse = (squares / found.samples.max(1) as f64).sqrt();
    found
}

/// All channels as one: every sample counts the same.
pub fn total(channels: &[ChannelDifference]) -> ChannelDifference {
    let mut all = ChannelDifference { channel: "all".to_owned(), ..ChannelDifference::default() };
    let mut squares = 0.0;
    for channel in channels {
        squares += channel.rmse * channel.rmse * channel.samples as f64;
        all.samples += channel.samples;
        all.differing += channel.differing;
        all.not_finite = [0, 1].map(|k| all.not_finite[k] + channel.not_finite[k]);
        if channel.max > all.max {
            (all.max, all.max_at) = (channel.max, channel.max_at);
        }
    }
    all.rmse = (squares / all.samples.max(1) as f64).sqrt();
    all
}

/// Absolute differences of a channel; `None` where either sample is NaN or infinite.
pub fn absolute<'a>(a: &'a Samples, b: &'a Samples) -> impl Iterator<Item = Option<f64>> + 'a {
    numbers(a).zip(numbers(b)).map(|(a, b)| finite_difference(a, b))
}

/// FLIP of each pixel of two pictures as `caribou render --preview` shows them; `None` without channels R, G and B.
pub fn flip_of(a: &Image, b: &Image) -> Option<Vec<f32>> {
    Some(flip(&displayed(a)?, &displayed(b)?, a.width()))
}

fn displayed(image: &Image) -> Option<Vec<[u8; 3]>> {
    let (r, g, b) = (image.floats("R")?, image.floats("G")?, image.floats("B")?);
    Some(r.iter().zip(g).zip(b).map(|((r, g), b)| display([*r, *g, *b], 1.0)).collect())
}

fn finite_difference(a: f64, b: f64) -> Option<f64> {
    (a.is_finite() && b.is_finite()).then(|| (a - b).abs())
}

/// Samples as numbers: a double holds each of them exactly.
fn numbers(samples: &Samples) -> Box<dyn Iterator<Item = f64> + '_> {
    match samples {
        Samples::Half(values) | Samples::Float(values) => Box::new(values.iter().map(|&value| f64::from(value))),
        Samples::Uint(values) => Box::new(values.iter().map(|&value| f64::from(value))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(channels: &[(&str, [f32; 4])]) -> Image {
        let mut image = Image::new(2, 2).unwrap();
        for (name, values) in channels {
            image.push(name, Samples::Float(values.to_vec())).unwrap();
        }
        image
    }

    #[test]
    fn known_differences() {
        let a = image(&[("R", [0.0, 1.0, 2.0, 3.0]), ("Z", [5.0; 4])]);
        let b = image(&[("Z", [5.0; 4]), ("R", [0.0, 1.0, 5.0, -1.0])]);
        let found = channel_differences(&a, &b);
        assert_eq!((found[0].channel.as_str(), found[0].rmse, found[0].max), ("R", 2.5, 4.0));
        assert_eq!((found[0].max_at, found[0].differing, found[0].samples), (Some([1, 1]), 2, 4));
        assert_eq!((found[1].rmse, found[1].max_at, found[1].differing), (0.0, None, 0));
        let all = total(&found);
        assert_eq!((all.rmse, all.max, all.samples), ((25.0f64 / 8.0).sqrt(), 4.0, 8));
    }

    #[test]
    fn nan_and_infinity_are_counted_and_hide_nothing_else() {
        let a = image(&[("R", [f32::NAN, 1.0, f32::INFINITY, 0.0])]);
        let b = image(&[("R", [f32::NAN, 3.0, 0.0, f32::NEG_INFINITY])]);
        let [found] = &channel_differences(&a, &b)[..] else { panic!("one channel") };
        assert_eq!((found.not_finite, found.samples, found.differing), ([2, 2], 1, 4));
        assert_eq!((found.rmse, found.max), (2.0, 2.0));
        assert_eq!(total(std::slice::from_ref(found)).not_finite, [2, 2]);
    }

    #[test]
    fn integers_are_compared_exactly() {
        let ids = |last| {
            let mut image = Image::new(2, 1).unwrap();
            image.push("primId", Samples::Uint(vec![7, last])).unwrap();
            image
        };
        let found = channel_differences(&ids(u32::MAX), &ids(u32::MAX - 1));
        assert_eq!((found[0].max, found[0].differing), (1.0, 1));
    }

    #[test]
    fn other_sizes_and_channels_are_refused_by_name() {
        let a = image(&[("R", [0.0; 4]), ("Z", [0.0; 4])]);
        let b = image(&[("R", [0.0; 4]), ("steps", [0.0; 4])]);
        let error = check_comparable(&a, &b).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains("first picture alone: Z, of the second alone: steps"), "{error}");
        let error = check_comparable(&a, &Image::new(2, 3).unwrap()).unwrap_err();
        assert!(error.to_string().contains("2 x 2 and 2 x 3"), "{error}");
        check_comparable(&a, &a).unwrap();
    }

    #[test]
    fn flip_sees_the_displayed_picture() {
        let flat = |value: f32| image(&[("R", [value; 4]), ("G", [value; 4]), ("B", [value; 4])]);
        assert_eq!(flip_of(&flat(0.5), &flat(0.5)), Some(vec![0.0; 4]));
        assert!(flip_of(&flat(0.0), &flat(1e9)).unwrap()[0] > 0.96);
        assert_eq!(flip_of(&image(&[("Z", [0.0; 4])]), &image(&[("Z", [0.0; 4])])), None);
    }
}
