//! Twin of `resolve.comp`: adds a sample to the sums of a pass.

use glam::Vec3;
use rayon::prelude::*;

use super::exact::exact_rcp;
use super::vec::dot3;
use crate::layout::{Frame, Path, StagePush};
use crate::shared::{LUMINANCE_BLUE, LUMINANCE_GREEN, LUMINANCE_RED, PATH_COVERED};

/// Luminance of a linear colour by Rec. 709; alpha is ignored.
pub fn luminance([r, g, b, _]: [f32; 4]) -> f32 {
    dot3(Vec3::new(LUMINANCE_RED, LUMINANCE_GREEN, LUMINANCE_BLUE), Vec3::new(r, g, b))
}

/// Adds the paths' radiance to `sums`, and squared deviations of its luminance to `spreads`; begins with the sample
/// before which there were none (`push.argument`) in this pass.
pub fn resolve(frame: &Frame, push: StagePush, paths: &[Path], sums: &mut [[f32; 4]], spreads: &mut [f32]) {
    sums.par_iter_mut().zip(spreads).zip(paths).for_each(|((sum, spread), path)| {
        let covered = frame.transparent == 0 || path.state & PATH_COVERED != 0;
        let [r, g, b] = path.radiance;
        let added = [r, g, b, if covered { 1.0 } else { 0.0 }];
        let before = push.argument;
        if before == 0 {
            (*sum, *spread) = (added, 0.0);
            return;
        }
        let old = *sum;
        sum.iter_mut().zip(added).for_each(|(sum, added)| *sum += added);
        let l = luminance(added);
        let from_old = l - luminance(old) * exact_rcp(before as f32);
        let from_new = l - luminance(*sum) * exact_rcp((before + 1) as f32);
        *spread += from_old * from_new;
    });
}
