//! Student's t distribution.

/// Degrees of freedom from which on the distribution is taken as it is there: 0.02 % from the normal one.
const MOST: u32 = 10_000;

/// The t for which a variable of `freedom` degrees lies in -t..t with probability `confidence`, 0 < confidence < 1.
/// No degrees of freedom count as one.
pub fn quantile(confidence: f64, freedom: u32) -> f64 {
    let freedom = freedom.clamp(1, MOST);
    let mut high = 1.0;
    while inside(high, freedom) < confidence && high < 1e12 {
        high *= 2.0;
    }
    // 60 halvings leave less than a rounding error of the interval.
    let (mut low, mut high) = (0.0, high);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if inside(middle, freedom) < confidence { low = middle } else { high = middle }
    }
    high
}

/// Probability of -t..t: the finite series of Abramowitz and Stegun 1964, 26.7.3 and 26.7.4.
fn inside(t: f64, freedom: u32) -> f64 {
    let angle = (t / f64::from(freedom).sqrt()).atan();
    let (sin, cos) = angle.sin_cos();
    let odd = freedom % 2;
    // Terms cos^k times 2/3 4/5 ... for odd degrees, 1/2 3/4 ... for even ones.
    let mut term = if odd == 1 { cos } else { 1.0 };
    let mut sum = 0.0;
    for k in (odd..freedom.saturating_sub(1)).step_by(2) {
        sum += term;
        let k = f64::from(k);
        term *= cos * cos * (k + 1.0) / (k + 2.0);
    }
    if odd == 1 { (angle + sin * sum) * std::f64::consts::FRAC_2_PI } else { sin * sum }
}

#[cfg(test)]
mod tests {
    use super::quantile;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (freedom, expected) in
            [(1, 12.706), (2, 4.303), (3, 3.182), (4, 2.776), (9, 2.262), (30, 2.042), (120, 1.980)]
        {
            assert!((quantile(0.95, freedom) - expected).abs() < 6e-4, "{freedom}: {}", quantile(0.95, freedom));
        }
        assert!((quantile(0.99, 10) - 3.169).abs() < 6e-4);
        assert!((quantile(0.95, u32::MAX) - 1.960).abs() < 6e-4);
        assert_eq!(quantile(0.95, 0), quantile(0.95, 1));
    }
}
