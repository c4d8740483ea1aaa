//! Accesses of a virtual SM's L1, counted by a kernel that runs warps in lockstep: an account of divergence,
//! coalescing and replacement that shares nothing with a replay of step traces but what it is to find.

use super::geometry::Geometry;
use super::options::{NodeFormat, Query};
use super::stream::Stream;
use super::tracer::exactness;
use crate::bvh::Bvh;
use crate::layout::{AccessCounts, Hit, Ray, VirtualPush, WarpSlot};
use crate::shared::*;
use crate::vulkan::{Gpu, Kernel, Place};
use crate::{Error, Result};

/// Dispatches between looks whether any warp is left.
const DISPATCHES_A_SUBMISSION: u32 = 16;

/// Number that no line of a cache has.
const NO_LINE: u32 = 0x7fff_ffff;

/// SMs that take turns among their warps, each with an L1 of its own.
///
/// Slot k of SM s runs warps s + k n, s + (k + w) n, ... of the launch, n SMs of w warps each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VirtualSms {
    /// SMs.
    pub sms: u32,
    /// Warps that an SM holds, at most [`VIRTUAL_WARPS`].
    pub warps: u32,
    /// Sets of the L1, a power of two. It has at most [`VIRTUAL_LINES`] lines.
    pub sets: u32,
    /// Lines of a set, at most [`WARP`].
    pub ways: u32,
    /// Sets go by the hash of GF100's L1, which is for 32 or 64 of them; otherwise by the low bits of a line's number.
    pub hashed: bool,
}

/// First line (address / 128) of each array in the virtual memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FirstLines {
    /// Nodes.
    pub nodes: u32,
    /// Triangles.
    pub triangles: u32,
    /// Rays.
    pub rays: u32,
    /// Hits.
    pub hits: u32,
    /// Stacks of all resident threads, an entry of each after the other.
    pub stacks: u32,
}

/// What memory instructions did, of each SM and by `ACCESS_*` kind.
pub type CountsBySm = Vec<[AccessCounts; ACCESS_KINDS as usize]>;

/// Traces `rays` by the kernel and counts what the SMs' caches see.
///
/// # Errors
/// [`Error::Device`] if the driver fails.
///
/// # Panics
/// If `machine` exceeds its limits.
pub fn virtual_l1(
    gpu: &Gpu,
    bvh: &Bvh,
    (query, rays): (Query, &[Ray]),
    machine: &VirtualSms,
    lines: &FirstLines,
) -> Result<(Vec<Hit>, CountsBySm)> {
    let VirtualSms { sms, warps, sets, ways, hashed } = *machine;
    assert!(warps <= VIRTUAL_WARPS && ways <= WARP && sets * ways <= VIRTUAL_LINES, "{machine:?}");
    let slots = sms * warps;
    let threads = u64::from(slots * WARP);
    let geometry = Geometry::upload(gpu, bvh, NodeFormat::Full, None)?;
    let first_warps: Vec<WarpSlot> = (0..slots).map(|warp| WarpSlot { warp, phase: 0 }).collect();
    let slot_buffer = gpu.upload("warps of virtual SMs", &first_warps)?;
    let counts = gpu.upload("counts of virtual L1s", &vec![AccessCounts::default(); (sms * ACCESS_KINDS) as usize])?;
    let hits = gpu.buffer("hits", size_of_val(rays) as u64 / 2, Place::Device)?;
    let buffers = [
        &gpu.upload("rays", rays)?,
        &hits,
        &gpu.buffer("cursors", threads * 8, Place::Device)?,
        // The end marker, and what traversal puts off.
        &gpu.buffer("stacks", threads * 4 * u64::from(1 + STACK_SIZE), Place::Device)?,
        &slot_buffer,
        &gpu.upload("virtual L1s", &vec![NO_LINE; (sms * VIRTUAL_LINES) as usize])?,
        &counts,
    ];
    let mut spec = exactness(gpu.probe()).to_vec();
    spec.push((SPEC_ANY_HIT, (query == Query::Any).into()));
    let pipeline = gpu.pipeline(Kernel::VirtualL1, &spec)?;
    let count = u32::try_from(rays.len()).map_err(|_| Error::device("virtual L1", "too many rays", "trace fewer"))?;
    let mut push = VirtualPush {
        nodes: geometry.nodes(),
        triangles: geometry.triangles(),
        scene_low: geometry.bounds[0],
        turn: 0,
        scene_high: geometry.bounds[1],
        count,
        node_line: lines.nodes,
        triangle_line: lines.triangles,
        ray_line: lines.rays,
        hit_line: lines.hits,
        stack_line: lines.stacks,
        sms,
        warps,
        sets,
        ways,
        hashed: hashed.into(),
    };
    let mut stream = Stream::new(gpu);
    let reached = [&geometry.tree];
    loop {
        for _ in 0..DISPATCHES_A_SUBMISSION {
            stream.dispatch("virtual L1", &pipeline, (&buffers, &reached), &push, sms * WARP)?;
            push.turn = (push.turn + VIRTUAL_TURNS) % warps;
        }
        stream.finish()?;
        let left = gpu.download::<WarpSlot>(&slot_buffer, 0..slots as usize)?;
        if left.iter().all(|slot| slot.warp >= count.div_ceil(WARP)) {
            break;
        }
    }
    let counts = gpu.download::<AccessCounts>(&counts, 0..(sms * ACCESS_KINDS) as usize)?;
    let by_sm = counts.as_chunks().0.to_vec();
    Ok((gpu.download(&hits, 0..rays.len())?, by_sm))
}
