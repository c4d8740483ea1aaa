//! Whether a device gives what the twin gives, bit for bit.

use super::bench::{Bench, GpuBench, Traced, TwinBench};
use crate::Result;
use crate::bvh::Bvh;
use crate::layout::Frame;
use crate::render::rays::RayKind;
use crate::scene::tables::Tables;
use crate::trace::TracerOptions;
use crate::trace::digest::hits_digest;
use crate::trace::verify::Verdict;
use crate::vulkan::Gpu;

/// Rays, hits (prim, t, u, v) and counters of every kind of ray on the device and on the twin.
///
/// # Errors
/// [`crate::Error::Device`] if the device fails.
pub fn verify_rays(gpu: &Gpu, bvh: &Bvh, tables: &Tables, frame: Frame) -> Result<Vec<Verdict>> {
    let mut device = GpuBench::new(gpu, (bvh, tables), frame, TracerOptions::default())?;
    let mut twin = TwinBench { bvh, tables, frame };
    let mut verdicts = Vec::new();
    for kind in RayKind::ALL {
        verdicts.extend(compare(kind, &device.trace(kind)?, &twin.trace(kind)?));
    }
    Ok(verdicts)
}

fn compare(kind: RayKind, device: &Traced, twin: &Traced) -> [Verdict; 3] {
    let verdict = |what: &str, mismatches, digest| Verdict {
        what: format!("{} {what}", kind.name()),
        cases: twin.rays.len() as u64,
        mismatches,
        digest,
    };
    [
        verdict("rays", differing(&device.rays, &twin.rays), None),
        verdict("hits", differing(&device.hits, &twin.hits), Some(hits_digest(&device.hits))),
        verdict("counters", differing(&device.counters, &twin.counters), None),
    ]
}

fn differing<T: bytemuck::Pod>(a: &[T], b: &[T]) -> u64 {
    let missing = a.len().abs_diff(b.len());
    (missing + a.iter().zip(b).filter(|(a, b)| bytemuck::bytes_of(*a) != bytemuck::bytes_of(*b)).count()) as u64
}
