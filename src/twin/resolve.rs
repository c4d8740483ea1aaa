//! Twin of `resolve.comp`: adds a sample to the film.

use rayon::prelude::*;

use super::exact::exact_rcp;
use crate::layout::{Frame, Path, StagePush};
use crate::shared::PATH_COVERED;

/// Adds the paths' radiance to `film`, and divides by the number of samples after the last one.
pub fn resolve(frame: &Frame, push: StagePush, paths: &[Path], film: &mut [[f32; 4]]) {
    film.par_iter_mut().zip(paths).for_each(|(pixel, path)| {
        let covered = frame.transparent == 0 || path.state & PATH_COVERED != 0;
        let [r, g, b] = path.radiance;
        let mut sum = [r, g, b, if covered { 1.0 } else { 0.0 }];
        for (sum, old) in sum.iter_mut().zip(*pixel) {
            if push.sample_index > 0 {
                *sum += old;
            }
            if push.argument != 0 {
                *sum *= exact_rcp(frame.samples as f32);
            }
        }
        *pixel = sum;
    });
}
