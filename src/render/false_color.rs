//! AOVs made visible.

use super::aov::Aov;
use super::image::{Image, Samples};
use super::tone::srgb;
use crate::shared::{NO_HIT, Z_NOTHING};

/// The values that the ends of a colour scale stand for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Shown as the darkest colour (`Z`: as the brightest, near is bright).
    pub min: f32,
    /// Shown as the other end; values beyond look the same.
    pub max: f32,
}

/// Inferno by Nathaniel Smith and Stefan van der Walt (matplotlib, CC0) at 17 equal steps: perceptually
/// uniform, so equal differences look equal; interpolated linearly in between (off by at most 3 of 255).
const INFERNO: [[u8; 3]; 17] = [
    [0, 0, 4],
    [10, 7, 34],
    [31, 12, 72],
    [59, 9, 100],
    [85, 15, 109],
    [111, 25, 110],
    [136, 34, 106],
    [162, 43, 98],
    [186, 54, 85],
    [208, 69, 69],
    [227, 89, 51],
    [241, 113, 31],
    [249, 140, 10],
    [252, 170, 15],
    [249, 201, 50],
    [242, 232, 101],
    [252, 255, 164],
];

/// Share of the pixels that a scale covers; a few outliers would otherwise darken all the rest.
const PERCENTILE: f64 = 0.995;

/// The pixels of `aov` as 8-bit sRGB, with the range of the scale if it has one; `None` if the image
/// does not hold that AOV. Scalars are scaled to the 99.5th percentile of the pixels that show a
/// surface: `steps`, `migrations`, `subtrees` and `samples` as heat maps from 0, `Z` in greys with near bright, `P` by its bounds. `N` is
/// 0.5 + 0.5 n, `primId` a colour hashed from the id. Pixels that show nothing are black, except in
/// `steps`.
pub fn false_color(image: &Image, aov: Aov) -> Option<(Vec<[u8; 3]>, Option<Range>)> {
    let planes: Vec<&[f32]> = aov.channels().iter().filter_map(|name| image.floats(name)).collect();
    match (aov, planes.as_slice()) {
        (Aov::Steps | Aov::Migrations | Aov::Subtrees | Aov::Samples, [steps]) => {
            let range = from_zero(steps);
            Some((steps.iter().map(|value| heat(*value, range)).collect(), Some(range)))
        }
        (Aov::Z, [z]) => {
            let range = bounds(z, |i| z[i] < Z_NOTHING);
            let grey = |z: f32| if z < Z_NOTHING { byte(1.0 - 0.9 * fraction(z, range)) } else { 0 };
            Some((z.iter().map(|z| [grey(*z); 3]).collect(), Some(range)))
        }
        (Aov::N, [x, y, z]) => Some((vectors([x, y, z], |_, n| byte(0.5 + 0.5 * n)), None)),
        (Aov::P, [x, y, z]) => {
            let ranges = [x, y, z].map(|plane| bounds(plane, |i| [x[i], y[i], z[i]] != [0.0; 3]));
            Some((vectors([x, y, z], |axis, p| byte(fraction(p, ranges[axis]))), None))
        }
        (Aov::Albedo, [r, g, b]) => Some((vectors([r, g, b], |_, value| srgb(value)), None)),
        (Aov::PrimId, _) => match image.channel(aov.name())? {
            Samples::Uint(ids) => Some((ids.iter().map(|id| hashed(*id)).collect(), None)),
            Samples::Half(_) | Samples::Float(_) => None,
        },
        _ => None,
    }
}

/// A scale from 0 to the 99.5th percentile of `values`.
pub fn from_zero(values: &[f32]) -> Range {
    Range { min: 0.0, max: percentile(values.iter().copied(), PERCENTILE) }
}

/// Colour of `value` in a heat map over `range`.
pub fn heat(value: f32, range: Range) -> [u8; 3] {
    inferno(fraction(value, range))
}

/// Each component by `show(axis, value)`; the zero vector, which marks a miss, stays black.
fn vectors(planes: [&[f32]; 3], show: impl Fn(usize, f32) -> u8) -> Vec<[u8; 3]> {
    let pixel = |i| {
        let vector = planes.map(|plane: &[f32]| plane[i]);
        if vector == [0.0; 3] { [0; 3] } else { std::array::from_fn(|axis| show(axis, vector[axis])) }
    };
    (0..planes[0].len()).map(pixel).collect()
}

fn inferno(fraction: f32) -> [u8; 3] {
    let position = fraction * (INFERNO.len() - 1) as f32;
    let index = (position as usize).min(INFERNO.len() - 2);
    let (low, high, weight) = (INFERNO[index], INFERNO[index + 1], position - index as f32);
    std::array::from_fn(|i| (f32::from(low[i]) * (1.0 - weight) + f32::from(high[i]) * weight).round() as u8)
}

/// A colour that is stable from run to run and differs between neighbours: the bits of the id mixed by
/// a multiplicative hash (Knuth, TAOCP 6.4), each byte in the upper three quarters so none is near black.
fn hashed(id: u32) -> [u8; 3] {
    if id == NO_HIT {
        return [0; 3];
    }
    let mixed = (id.wrapping_add(1)).wrapping_mul(0x9E37_79B1);
    let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x9E37_79B1);
    [24, 16, 8].map(|shift| 64 + ((mixed >> shift) & 0xFF) as u8 / 4 * 3)
}

/// Where `value` stands in `range`, 0..1; 0 in a range of one value.
fn fraction(value: f32, range: Range) -> f32 {
    let fraction = (value - range.min) / (range.max - range.min);
    if fraction.is_nan() { 0.0 } else { fraction.clamp(0.0, 1.0) }
}

fn byte(value: f32) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// Smallest value and upper percentile of the pixels that show a surface.
fn bounds(values: &[f32], covered: impl Fn(usize) -> bool) -> Range {
    let covered = || (0..values.len()).filter(|i| covered(*i)).map(|i| values[i]);
    Range { min: percentile(covered(), 0.0), max: percentile(covered(), PERCENTILE) }
}

/// The value that a share `p` of the values does not exceed; 0 for none.
fn percentile(values: impl Iterator<Item = f32>, p: f64) -> f32 {
    let mut values: Vec<f32> = values.filter(|value| value.is_finite()).collect();
    if values.is_empty() {
        return 0.0;
    }
    let index = ((values.len() - 1) as f64 * p).round() as usize;
    *values.select_nth_unstable_by(index, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four pixels, the last shows nothing.
    fn image(channels: &[(&str, [f32; 4])]) -> Image {
        let mut image = Image::new(4, 1).unwrap();
        for (name, values) in channels {
            image.push(name, Samples::Float(values.to_vec())).unwrap();
        }
        image
    }

    #[test]
    fn steps_run_from_zero_to_the_percentile() {
        let mut steps = vec![10.0; 999];
        steps[0] = 0.0;
        steps.push(1e6);
        let mut image = Image::new(1000, 1).unwrap();
        image.push("steps", Samples::Float(steps)).unwrap();
        let (pixels, range) = false_color(&image, Aov::Steps).unwrap();
        assert_eq!(range, Some(Range { min: 0.0, max: 10.0 }));
        assert_eq!(pixels[0], INFERNO[0]);
        assert_eq!((pixels[1], pixels[999]), (INFERNO[16], INFERNO[16]));
        assert_eq!(inferno(0.5), INFERNO[8]);
    }

    #[test]
    fn depth_ignores_misses_and_is_bright_near() {
        let (pixels, range) = false_color(&image(&[("Z", [1.0, 2.0, 3.0, Z_NOTHING])]), Aov::Z).unwrap();
        assert_eq!(range, Some(Range { min: 1.0, max: 3.0 }));
        assert_eq!(pixels[0], [255; 3]);
        assert!(pixels[1] > pixels[2] && pixels[2] > pixels[3] && pixels[3] == [0; 3]);
    }

    #[test]
    fn normals_are_centred_on_grey() {
        let n = image(&[("N.X", [1.0, 0.0, 0.0, 0.0]), ("N.Y", [0.0, -1.0, 0.0, 0.0]), ("N.Z", [0.0, 0.0, 1.0, 0.0])]);
        let (pixels, range) = false_color(&n, Aov::N).unwrap();
        assert_eq!(pixels, [[255, 128, 128], [128, 0, 128], [128, 128, 255], [0, 0, 0]]);
        assert_eq!(range, None);
    }

    #[test]
    fn ids_get_stable_different_colors_and_misses_black() {
        let mut image = Image::new(4, 1).unwrap();
        image.push("primId", Samples::Uint(vec![0, 1, 0, NO_HIT])).unwrap();
        let (pixels, _) = false_color(&image, Aov::PrimId).unwrap();
        assert_eq!(pixels[0], pixels[2]);
        assert_ne!(pixels[0], pixels[1]);
        assert_eq!(pixels[3], [0; 3]);
        let distinct: std::collections::HashSet<_> = (0..1000).map(hashed).collect();
        assert!(distinct.len() > 980, "{} of 1000 neighbouring ids differ", distinct.len());
    }

    #[test]
    fn positions_and_albedo_have_three_channels() {
        let p = ["P.X", "P.Y", "P.Z"].map(|name| (name, [1.0, 2.5, 4.0, 0.0]));
        assert_eq!(false_color(&image(&p), Aov::P).unwrap().0, [[0; 3], [128; 3], [255; 3], [0; 3]]);
        let albedo = ["albedo.R", "albedo.G", "albedo.B"].map(|name| (name, [0.0, 0.215_861, 1.0, 0.0]));
        assert_eq!(false_color(&image(&albedo), Aov::Albedo).unwrap().0, [[0; 3], [128; 3], [255; 3], [0; 3]]);
    }

    #[test]
    fn an_aov_that_is_absent_or_constant_does_no_harm() {
        for aov in Aov::ALL {
            assert!(false_color(&image(&[]), aov).is_none());
        }
        let (pixels, range) = false_color(&image(&[("steps", [0.0; 4])]), Aov::Steps).unwrap();
        assert_eq!((pixels[0], range), (INFERNO[0], Some(Range { min: 0.0, max: 0.0 })));
    }
}
