//! Whether a device gives what the twin gives, bit for bit.

use super::bench::{Bench, GpuBench, TwinBench};
use crate::Result;
use crate::bvh::Bvh;
use crate::fermi::launch::Workload;
use crate::fermi::lockstep;
use crate::layout::{AccessCounts, Frame, Ray};
use crate::render::rays::{RayKind, twin_rays};
use crate::scene::tables::Tables;
use crate::trace::digest::hits_digest;
use crate::trace::steps::record_steps;
use crate::trace::verify::Verdict;
use crate::trace::virtual_l1::{VirtualSms, virtual_l1};
use crate::trace::{Query, TracerOptions};
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

/// Fermi's L1 at both of its sizes (fermi.md, Caches), each with one of the mappings from line to set.
pub const VIRTUAL_L1S: [(&str, VirtualSms); 2] = [
    ("16 KiB", VirtualSms { sms: 15, warps: 4, sets: 32, ways: 4, hashed: false }),
    ("48 KiB, hashed", VirtualSms { sms: 15, warps: 4, sets: 64, ways: 6, hashed: true }),
];

/// Rays of a kind for which the virtual L1 is compared at most, from the middle of the picture: a kernel in lockstep
/// is slow.
const VIRTUAL_RAYS: usize = 4096;

/// The L1 of virtual SMs, for every kind of ray.
///
/// # Errors
/// [`crate::Error::Device`] if the device fails.
pub fn verify_virtual_l1s(gpu: &Gpu, bvh: &Bvh, tables: &Tables, frame: Frame) -> Result<Vec<Verdict>> {
    let mut verdicts = Vec::new();
    for kind in RayKind::ALL {
        let rays = twin_rays(bvh, tables, &frame, kind);
        let first = rays.len().saturating_sub(VIRTUAL_RAYS) / 2;
        let middle = &rays[first..rays.len().min(first + VIRTUAL_RAYS)];
        for (name, machine) in &VIRTUAL_L1S {
            let what = format!("{}, L1 accesses, {name}", kind.name());
            verdicts.push(Verdict { what, ..verify_virtual_l1(gpu, bvh, (kind.query(), middle), machine)? });
        }
    }
    Ok(verdicts)
}

/// Hits of the kernel that runs warps in lockstep, and what it counts of an L1, against a replay of the twin's step
/// traces. Mismatches are by how much all counts differ, and hits in any bit.
///
/// # Errors
/// [`crate::Error::Device`] if the device fails.
pub fn verify_virtual_l1(
    gpu: &Gpu,
    bvh: &Bvh,
    (query, rays): (Query, &[Ray]),
    machine: &VirtualSms,
) -> Result<Verdict> {
    let (twin_hits, trace) = record_steps(bvh, rays, query);
    let children: Vec<[u32; 2]> = bvh.nodes.iter().map(|node| node.child).collect();
    let workload = Workload { trace: &trace, children: &children, triangles: bvh.triangles.len(), cut: None };
    let replayed = lockstep::count(machine, &workload)?;
    let lines = lockstep::first_lines(&workload);
    let (hits, counted) = virtual_l1(gpu, bvh, (query, rays), machine, &lines)?;
    let words = |counts: &[[AccessCounts; 4]]| bytemuck::cast_slice::<_, u32>(counts).to_vec();
    let off = words(&counted).iter().zip(words(&replayed)).map(|(a, b)| u64::from(a.abs_diff(b))).sum::<u64>();
    Ok(Verdict {
        what: "L1 accesses".to_owned(),
        cases: replayed.iter().flatten().map(|counts| u64::from(counts.accesses)).sum(),
        mismatches: off + differing(&hits, &twin_hits),
        digest: None,
    })
}

fn differing<T: bytemuck::Pod>(a: &[T], b: &[T]) -> u64 {
    let missing = a.len().abs_diff(b.len());
    (missing + a.iter().zip(b).filter(|(a, b)| bytemuck::bytes_of(*a) != bytemuck::bytes_of(*b)).count()) as u64
}
