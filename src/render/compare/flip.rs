//! FLIP: how different two pictures look to someone who flips between them, 0 to 1 a pixel (Andersson, Nilsson,
//! Akenine-Möller, Oskarsson, Åström and Fairchild 2020, FLIP: A Difference Evaluator for Alternating Images). Names
//! and constants are the paper's.

use rayon::prelude::*;

use super::color::{Spaces, hyab};
use super::filter::{Kernel, Plane, balanced, kernel};

/// Pixels a degree of vision: 3840 pixels on 0.7 m, seen from 0.7 m (section 6).
const PIXELS_PER_DEGREE: f64 = 3840.0 * std::f64::consts::PI / 180.0;

/// Contrast sensitivity of Y, Cx and Cz: sums of Gaussians `a sqrt(pi / b) exp(-pi^2 x^2 / b)` of x degrees, as
/// pairs (a, b) (table 1).
const SENSITIVITY: [&[(f64, f64)]; 3] = [&[(1.0, 0.0047)], &[(1.0, 0.0053)], &[(34.1, 0.04), (13.5, 0.025)]];

/// Widest of these b: sets the radius, three standard deviations.
const WIDEST: f64 = 0.04;

/// Exponent of the colour difference (section 4.1.3).
const Q_C: f64 = 0.7;
/// Share of the largest colour difference that is spread over [`P_T`] of the scale, so that small ones show.
const P_C: f64 = 0.4;
const P_T: f64 = 0.95;

/// Width of a feature in degrees: where edges are seen best (section 4.2).
const FEATURE_WIDTH: f64 = 0.082;
/// Exponent of the feature difference.
const Q_F: f64 = 0.5;

/// FLIP's difference of each pixel of two pictures as a screen shows them, sRGB, row-major, `width` across.
pub fn flip(reference: &[[u8; 3]], test: &[[u8; 3]], width: usize) -> Vec<f32> {
    let spaces = Spaces::new();
    let [reference, test] = [reference, test].map(|pixels| Seen::new(&spaces, pixels, width));
    let largest = largest_difference(&spaces);
    let pixel = |i: usize| {
        let color = redistributed(hyab(reference.colors[i], test.colors[i]).powf(Q_C), largest);
        let feature = |a: &[f64], b: &[f64]| (a[i] - b[i]).abs();
        let feature = feature(&reference.edges, &test.edges).max(feature(&reference.points, &test.points));
        // Both directions can differ at once, by sqrt 2.
        let feature = (feature * std::f64::consts::FRAC_1_SQRT_2).powf(Q_F);
        color.powf(1.0 - feature) as f32
    };
    (0..reference.colors.len()).into_par_iter().map(pixel).collect()
}

/// What the eye makes of a picture.
struct Seen {
    colors: Vec<[f64; 3]>,
    edges: Vec<f64>,
    points: Vec<f64>,
}

impl Seen {
    fn new(spaces: &Spaces, pixels: &[[u8; 3]], width: usize) -> Seen {
        let opponent: Vec<[f64; 3]> = pixels.par_iter().map(|&pixel| spaces.opponent(pixel)).collect();
        let plane = |axis: usize| Plane { width, values: opponent.iter().map(|color| color[axis]).collect() };
        let planes = [plane(0), plane(1), plane(2)];
        let blurred: [Plane; 3] = std::array::from_fn(|axis| blurred(&planes[axis], SENSITIVITY[axis]));
        let color = |i| spaces.hunt_lab(spaces.displayable(std::array::from_fn(|axis| blurred[axis].values[i])));
        let luminance = Plane { width, values: planes[0].values.iter().map(|y| (y + 16.0) / 116.0).collect() };
        let sigma = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
        Seen {
            colors: (0..pixels.len()).into_par_iter().map(color).collect(),
            edges: strength(&luminance, sigma, |x| -x),
            points: strength(&luminance, sigma, |x| x * x / (sigma * sigma) - 1.0),
        }
    }
}

/// Blurs as the eye does at this distance. A sum of Gaussians of different widths is not separable, each of them is.
fn blurred(plane: &Plane, sensitivity: &[(f64, f64)]) -> Plane {
    use std::f64::consts::PI;
    let radius = (3.0 * (WIDEST / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as u32;
    let gaussians: Vec<(f64, Kernel)> = sensitivity
        .iter()
        .map(|&(a, b)| {
            let gaussian = kernel(radius, |x| (-(PI * x / PIXELS_PER_DEGREE).powi(2) / b).exp());
            let area = gaussian.iter().sum::<f64>().powi(2);
            (a * (PI / b).sqrt() * area, balanced(gaussian))
        })
        .collect();
    let total: f64 = gaussians.iter().map(|(weight, _)| weight).sum();
    let mut sum = Plane { width: plane.width, values: vec![0.0; plane.values.len()] };
    for (weight, gaussian) in &gaussians {
        let part = plane.filtered(gaussian, gaussian);
        sum.values.iter_mut().zip(part.values).for_each(|(sum, value)| *sum += value * weight / total);
    }
    sum
}

/// Length of the vector of responses in x and y to a feature: `shape` under a Gaussian.
fn strength(luminance: &Plane, sigma: f64, shape: impl Fn(f64) -> f64) -> Vec<f64> {
    let radius = (3.0 * sigma).ceil() as u32;
    let gaussian = |x: f64| (-x * x / (2.0 * sigma * sigma)).exp();
    let feature = balanced(kernel(radius, |x| shape(x) * gaussian(x)));
    let smooth = balanced(kernel(radius, gaussian));
    let (x, y) = (luminance.filtered(&feature, &smooth), luminance.filtered(&smooth, &feature));
    x.values.iter().zip(&y.values).map(|(x, y)| x.hypot(*y)).collect()
}

/// The largest colour difference of a screen: green to blue.
fn largest_difference(spaces: &Spaces) -> f64 {
    hyab(spaces.hunt_lab(glam::DVec3::Y), spaces.hunt_lab(glam::DVec3::Z)).powf(Q_C)
}

/// Two straight lines from 0 to 1 that give small differences most of the scale.
fn redistributed(difference: f64, largest: f64) -> f64 {
    let bend = P_C * largest;
    match difference < bend {
        true => P_T / bend * difference,
        false => P_T + (difference - bend) / (largest - bend) * (1.0 - P_T),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 48;
    const HEIGHT: usize = 40;

    fn picture(pixel: impl Fn(usize, usize) -> [usize; 3]) -> Vec<[u8; 3]> {
        (0..WIDTH * HEIGHT).map(|i| pixel(i % WIDTH, i / WIDTH).map(|value| value as u8)).collect()
    }

    fn mean(a: &[[u8; 3]], b: &[[u8; 3]]) -> f64 {
        flip(a, b, WIDTH).iter().map(|&value| f64::from(value)).sum::<f64>() / a.len() as f64
    }

    fn pattern(shift: usize) -> Vec<[u8; 3]> {
        picture(|x, y| [x * 37 + y * 11 + shift * ((x / 8) % 4), x * 5 + y * 83, x * x + y * 7])
    }

    fn edge(at: usize) -> Vec<[u8; 3]> {
        picture(|x, _| if x > at { [200, 180, 40] } else { [20, 30, 90] })
    }

    /// Expected are the means that NVIDIA's flip-evaluator 1.7 (PyPI) gives, at the same pixels a degree.
    #[test]
    fn means_are_those_of_the_authors_program() {
        let flat = |color: [usize; 3]| picture(move |_, _| color);
        let firefly = picture(|x, y| if (x, y) == (24, 20) { [255; 3] } else { [60; 3] });
        for (name, a, b, expected) in [
            ("black and white", flat([0; 3]), flat([255; 3]), 0.967_400),
            ("green and blue", flat([0, 255, 0]), flat([0, 0, 255]), 1.0),
            ("greys", flat([100; 3]), flat([110; 3]), 0.153_503),
            ("pattern", pattern(0), pattern(3), 0.063_751),
            ("edge", edge(20), edge(21), 0.087_800),
            ("firefly", flat([60; 3]), firefly, 0.004_285),
        ] {
            let found = mean(&a, &b);
            assert!((found - expected).abs() < 5e-5, "{name}: {found}, not {expected}");
        }
    }

    #[test]
    fn identical_pictures_do_not_differ_and_order_does_not_matter() {
        let (a, b) = (pattern(0), edge(20));
        assert!(flip(&a, &a, WIDTH).iter().all(|&value| value == 0.0));
        assert_eq!(flip(&a, &b, WIDTH), flip(&b, &a, WIDTH));
        assert!(flip(&a, &b, WIDTH).iter().all(|value| (0.0..=1.0).contains(value)));
    }

    /// Moving both pictures moves the difference, away from borders.
    #[test]
    fn the_difference_moves_with_the_pictures() {
        let dot = |at: usize| picture(move |x, y| if (x, y) == (at, 20) { [250, 90, 10] } else { [60; 3] });
        let [here, there] = [20, 23].map(|at| flip(&dot(99), &dot(at), WIDTH));
        for y in 0..HEIGHT {
            for x in 0..WIDTH - 3 {
                let (a, b) = (here[y * WIDTH + x], there[y * WIDTH + x + 3]);
                assert!((a - b).abs() < 1e-6, "({x}, {y}): {a} {b}");
            }
        }
        assert!(here[20 * WIDTH + 20] > 0.1);
    }

    #[test]
    fn pictures_smaller_than_the_filters_are_compared() {
        assert_eq!(flip(&[[9; 3]], &[[9; 3]], 1), [0.0]);
        assert!(flip(&[[0; 3]], &[[255; 3]], 1)[0] > 0.9);
    }
}
