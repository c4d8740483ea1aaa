//! Twin of `gather.comp`: adds what shadow rays bring.

use glam::Vec3;
use rayon::prelude::*;

use crate::layout::{Contribution, Hit, Path, Ray};

/// Adds each contribution whose shadow ray arrived.
pub fn gather(shadow_rays: &[Ray], shadow_hits: &[Hit], contributions: &[Contribution], paths: &mut [Path]) {
    paths.par_iter_mut().zip(shadow_rays).zip(shadow_hits).zip(contributions).for_each(
        |(((path, ray), hit), contribution)| {
            if ray.is_live() && !hit.is_hit() {
                path.radiance = (Vec3::from(path.radiance) + Vec3::from(contribution.radiance)).into();
            }
        },
    );
}
