//! Sine and cosine from exact operations only. The system's libm differs between machines in the last
//! bit, which would change a scene's digest.

/// Sine and cosine of an angle in full turns. Exact at multiples of a quarter turn, so the seam of a
/// surface of revolution closes; elsewhere within 1e-15.
pub fn sin_cos_turns(turns: f64) -> (f64, f64) {
    let quarters = (turns * 4.0).round();
    let angle = (turns - quarters * 0.25) * std::f64::consts::TAU; // within an eighth turn of zero
    let (sin, cos) = (sin_series(angle), cos_series(angle));
    match quarters.rem_euclid(4.0) as u8 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// [`sin_cos_turns`] rounded to f32.
pub fn sin_cos(turns: f32) -> (f32, f32) {
    let (sin, cos) = sin_cos_turns(f64::from(turns));
    (sin as f32, cos as f32)
}

/// Taylor series to x^17; the first term left out is below 1e-19 at pi/4.
fn sin_series(x: f64) -> f64 {
    series(x, &[16.0 * 17.0, 14.0 * 15.0, 12.0 * 13.0, 10.0 * 11.0, 8.0 * 9.0, 6.0 * 7.0, 4.0 * 5.0, 2.0 * 3.0]) * x
}

/// Taylor series to x^16; the first term left out is below 1e-17 at pi/4.
fn cos_series(x: f64) -> f64 {
    series(x, &[15.0 * 16.0, 13.0 * 14.0, 11.0 * 12.0, 9.0 * 10.0, 7.0 * 8.0, 5.0 * 6.0, 3.0 * 4.0, 1.0 * 2.0])
}

/// 1 - x^2/d_n (1 - x^2/d_(n-1) (1 - ...)), divisors innermost first.
fn series(x: f64, divisors: &[f64]) -> f64 {
    divisors.iter().fold(1.0, |inner, divisor| 1.0 - x * x / divisor * inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_libm() {
        for step in -4000..4000 {
            let turns = f64::from(step) / 997.0;
            let (sin, cos) = sin_cos_turns(turns);
            let angle = turns * std::f64::consts::TAU;
            assert!((sin - angle.sin()).abs() < 1e-14, "sin of {turns} turns: {sin}");
            assert!((cos - angle.cos()).abs() < 1e-14, "cos of {turns} turns: {cos}");
        }
    }

    #[test]
    fn exact_at_quarter_turns() {
        let expected = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0), (0.0, 1.0)];
        for (quarter, expected) in expected.into_iter().enumerate() {
            assert_eq!(sin_cos_turns(quarter as f64 / 4.0), expected);
        }
    }
}
