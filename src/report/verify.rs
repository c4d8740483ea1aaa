//! Whether a device gives what the twin gives, bit for bit.

use super::bench::{Bench, GpuBench, TwinBench};
use crate::Result;
use crate::bvh::Bvh;
use crate::layout::Frame;
use crate::render::rays::RayKind;
use crate::scene::tables::Tables;
use crate::trace::TracerOptions;
use crate::trace::digest::hits_digest;
use crate::trace::verify::Verdict;
use crate::vulkan::Gpu;

/// Rays, hits (prim, t, u, v) and counters of every kind of ray, strategy and format of nodes on the device and on the twin.
///
/// # Errors
/// [`crate::Error::Device`] if the device fails.
pub fn verify_rays(gpu: &Gpu, bvh: &Bvh, tables: &Tables, frame: Frame) -> Result<Vec<Verdict>> {
    let mut verdicts = Vec::new();
    for options in TracerOptions::all() {
        let mut device = GpuBench::new(gpu, (bvh, tables), frame, &options)?;
        let mut twin = TwinBench::new((bvh, tables), frame, &options)?;
        for kind in RayKind::ALL {
            let rays = twin.rays(kind)?;
            let name = format!("{} {}", options.name(), kind.name());
            let verdict = |what: &str, mismatches, digest| Verdict {
                what: format!("{name} {what}"),
                cases: rays.len() as u64,
                mismatches,
                digest,
            };
            verdicts.push(verdict("rays", differing(&device.rays(kind)?, &rays), None));
            let (on_device, on_twin) = (device.trace(kind, &rays)?, twin.trace(kind, &rays)?);
            let digest = Some(hits_digest(&on_device.hits));
            verdicts.push(verdict("hits", differing(&on_device.hits, &on_twin.hits), digest));
            verdicts.push(verdict("counters", differing(&on_device.counters, &on_twin.counters), None));
            let rounds = u64::from(on_device.migration != on_twin.migration);
            verdicts.push(verdict("rounds and SMs", rounds, None));
        }
    }
    Ok(verdicts)
}

fn differing<T: bytemuck::Pod>(a: &[T], b: &[T]) -> u64 {
    let missing = a.len().abs_diff(b.len());
    (missing + a.iter().zip(b).filter(|(a, b)| bytemuck::bytes_of(*a) != bytemuck::bytes_of(*b)).count()) as u64
}
