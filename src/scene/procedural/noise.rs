//! Smooth random fields with exact gradients, for terrain and displaced surfaces.

use super::random::mix;
use glam::DVec3;

/// Sum of `octaves` of [`value_noise`], each with twice the frequency and half the amplitude of the
/// one before. Returns value (within -2..2) and gradient.
pub fn fractal_noise(point: DVec3, octaves: u32, seed: u64) -> (f64, DVec3) {
    let (mut sum, mut gradient) = (0.0, DVec3::ZERO);
    let (mut frequency, mut amplitude) = (1.0, 1.0);
    for octave in 0..octaves {
        let (value, slope) = value_noise(point * frequency, seed.wrapping_add(u64::from(octave)));
        sum += value * amplitude;
        gradient += slope * (amplitude * frequency);
        frequency *= 2.0;
        amplitude *= 0.5;
    }
    (sum, gradient)
}

/// Value noise: a random number in -1..1 at each lattice point, blended by the quintic of Perlin's
/// "Improving Noise" (2002), whose second derivative is continuous. Returns value and gradient.
pub fn value_noise(point: DVec3, seed: u64) -> (f64, DVec3) {
    let cell = point.floor();
    let f = point - cell;
    let weight = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let slope = f * f * (f - 1.0) * (f - 1.0) * 30.0;

    let corner = |x: f64, y: f64, z: f64| lattice(cell + DVec3::new(x, y, z), seed);
    // Along x first: value and difference on the four edges (y, z) = 00, 10, 01, 11.
    let edges = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].map(|(y, z)| {
        let (near, far) = (corner(0.0, y, z), corner(1.0, y, z));
        (lerp(near, far, weight.x), far - near)
    });
    let value = edges.map(|edge| edge.0);
    let difference = edges.map(|edge| edge.1);
    let along_y = |e: [f64; 4]| (lerp(e[0], e[1], weight.y), lerp(e[2], e[3], weight.y));

    let (near, far) = along_y(value);
    let (dx_near, dx_far) = along_y(difference);
    let gradient = DVec3::new(
        lerp(dx_near, dx_far, weight.z),
        lerp(value[1] - value[0], value[3] - value[2], weight.z),
        far - near,
    );
    (lerp(near, far, weight.z), gradient * slope)
}

fn lerp(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

/// The random number of one lattice point.
fn lattice(point: DVec3, seed: u64) -> f64 {
    let hash = [point.x, point.y, point.z].into_iter().fold(seed, |hash, c| mix(hash ^ (c as i64 as u64)));
    (hash >> 11) as f64 * (2.0 / (1u64 << 53) as f64) - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradient_matches_central_differences() {
        for step in 0..200 {
            let point = DVec3::new(0.37, -0.91, 0.53) * f64::from(step - 100) * 0.173;
            let (_, gradient) = fractal_noise(point, 3, 5);
            for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                let h = 1e-5;
                let slope =
                    (fractal_noise(point + axis * h, 3, 5).0 - fractal_noise(point - axis * h, 3, 5).0) / (2.0 * h);
                assert!((slope - gradient.dot(axis)).abs() < 1e-6, "{point}: {slope} and {gradient}");
            }
        }
    }

    #[test]
    fn bounded_and_continuous_across_cells() {
        for step in 0..1000 {
            let x = f64::from(step) * 0.1;
            let (a, _) = value_noise(DVec3::new(x, 0.4, 0.6), 1);
            let (b, _) = value_noise(DVec3::new(x - 1e-9, 0.4, 0.6), 1);
            assert!(a.abs() <= 1.0 && (a - b).abs() < 1e-7);
        }
    }
}
