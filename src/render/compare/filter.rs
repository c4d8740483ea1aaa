//! Separable filters of FLIP. Beyond a picture's border its outermost pixels go on.

use rayon::prelude::*;

/// Weights of the pixels from `-radius` to `radius`.
pub type Kernel = Vec<f64>;

/// Values of one quantity, row-major.
#[derive(Clone)]
pub struct Plane {
    /// Pixels across.
    pub width: usize,
    /// One a pixel.
    pub values: Vec<f64>,
}

impl Plane {
    /// This plane filtered by `across` in x and by `down` in y.
    pub fn filtered(&self, across: &Kernel, down: &Kernel) -> Plane {
        self.rows(across).columns(down)
    }

    fn rows(&self, kernel: &Kernel) -> Plane {
        let row = |row: &[f64]| -> Vec<f64> {
            (0..row.len()).map(|x| weighted(kernel, |step| row[moved(x, step, row.len())])).collect()
        };
        Plane { width: self.width, values: self.values.par_chunks(self.width).flat_map_iter(row).collect() }
    }

    fn columns(&self, kernel: &Kernel) -> Plane {
        let (width, height) = (self.width, self.values.len() / self.width);
        let row = |y: usize| {
            (0..width).map(move |x| weighted(kernel, |step| self.values[moved(y, step, height) * width + x]))
        };
        Plane { width, values: (0..height).into_par_iter().flat_map_iter(row).collect() }
    }
}

fn weighted(kernel: &Kernel, value: impl Fn(isize) -> f64) -> f64 {
    let radius = (kernel.len() / 2) as isize;
    kernel.iter().zip(-radius..).map(|(weight, step)| weight * value(step)).sum()
}

fn moved(at: usize, step: isize, length: usize) -> usize {
    at.saturating_add_signed(step).min(length - 1)
}

/// `weight(x)` for x from `-radius` to `radius`.
pub fn kernel(radius: u32, weight: impl Fn(f64) -> f64) -> Kernel {
    let radius = f64::from(radius);
    (0..=2 * radius as usize).map(|i| weight(i as f64 - radius)).collect()
}

/// The kernel scaled so that its positive weights sum to 1, and its negative ones, if any, to -1.
pub fn balanced(kernel: Kernel) -> Kernel {
    let sum = |sign: f64| kernel.iter().map(|weight| (weight * sign).max(0.0)).sum::<f64>();
    let (positive, negative) = (sum(1.0), sum(-1.0));
    kernel
        .iter()
        .map(|&weight| weight / if weight > 0.0 { positive } else { negative.max(f64::MIN_POSITIVE) })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn borders_go_on_and_steps_are_found() {
        let plane = Plane { width: 4, values: vec![1.0, 1.0, 3.0, 3.0, 1.0, 1.0, 3.0, 3.0] };
        let mean = balanced(kernel(1, |_| 1.0));
        let same = balanced(kernel(0, |_| 1.0));
        let close = |a: &Plane, b: &[f64]| assert!(a.values.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12));
        close(&plane.filtered(&mean, &same), &[1.0, 5.0 / 3.0, 7.0 / 3.0, 3.0, 1.0, 5.0 / 3.0, 7.0 / 3.0, 3.0]);
        close(&plane.filtered(&same, &mean), &plane.values);
        let slope = balanced(kernel(1, |x| x));
        assert_eq!(slope, [-1.0, 0.0, 1.0]);
        close(&plane.filtered(&slope, &same), &[0.0, 2.0, 2.0, 0.0, 0.0, 2.0, 2.0, 0.0]);
    }
}
