//! Fidelity `counters`: closed form from totals.
//!
//! How often each node and each line is visited, and how many instructions the longest warp has, are totals that
//! counters give without any order of accesses. Miss rates follow by Che's approximation of an LRU cache (Che, Tung
//! and Wang 2002), time from the slowest of issue, latency, bandwidth and the longest warp.

use std::collections::HashMap;

use super::launch::Launch;
use super::machine::{LINE, Machine};
use super::occupancy::launchable;
use super::profile::profile;
use super::result::{Counts, CpiStack, Instructions, Part};
use super::simt::{Access, Batch, LANES, Layout, Warp};
use super::times::{Times, line_cycles, reply_cycles};
use crate::Result;

/// Steps of the bisection for the characteristic time: as many as a double has bits of mantissa.
const BISECTIONS: usize = 53;

/// Totals of a launch.
#[derive(Debug, Default)]
struct Totals {
    /// How often each line is touched; accesses of a warp's visit to one line are one touch.
    lines: HashMap<u64, u64>,
    accesses: u64,
    /// Requests of memory instructions after their first.
    again: u64,
    /// Touches by loads, which wait.
    loads: u64,
    instructions: Instructions,
    warps: u64,
    visits: u64,
    /// Cycles of all warps and of the longest, each alone and hitting the L1.
    cycles: f64,
    longest: f64,
    /// Loads of the longest warp, those of one visit counted once.
    longest_loads: f64,
}

/// Predicts `launches` on `machine`, each by itself: the L2 is taken to be empty at the start of each.
///
/// # Errors
/// [`crate::Error::Usage`] if no block fits a multiprocessor.
pub fn predict(machine: &Machine, launches: &[Launch]) -> Result<Vec<Part>> {
    launches.iter().map(|launch| part(machine, launch)).collect()
}

fn part(machine: &Machine, launch: &Launch) -> Result<Part> {
    let occupancy = launchable(machine, launch)?;
    let totals = totals(machine, launch);
    let sms = f64::from(machine.sms);

    // Each multiprocessor sees its share of the touches of every line, and the L2 those that miss.
    let l1_lines = (machine.l1.sets() * machine.l1.ways) as f64 * f64::from(launch.caches());
    let per_sm: Vec<f64> = totals.lines.values().map(|&n| n as f64 / sms).collect();
    let l1_misses = missing(&per_sm, l1_lines) * sms;
    let touches: f64 = per_sm.iter().sum::<f64>() * sms;
    let below: Vec<f64> = per_sm.iter().map(|n| n * sms * l1_misses / touches.max(1.0)).collect();
    let l2_lines = (machine.l2.slice_kib * 1024 / LINE * u64::from(machine.l2.slices)) as f64;
    let l2_misses = missing(&below, l2_lines);

    let l1 = Counts { accesses: totals.accesses, misses: l1_misses.ceil() as u64, ..Counts::default() };
    let l2 = Counts { accesses: l1.misses, misses: (l2_misses.ceil() as u64).min(l1.misses), ..Counts::default() };
    let times = Times::unloaded(machine);
    let latencies = times.latency(l1, l2);
    // A visit of a warp waits for the slowest of its lines, which come one after the other.
    let memory = latencies.memory;
    let (lines_a_visit, misses_a_line) = (touches / totals.loads.max(1) as f64, l1_misses / touches.max(1.0));
    let any_misses = 1.0 - (1.0 - misses_a_line.min(1.0)).powf(lines_a_visit);
    let waiting = any_misses * memory + lines_a_visit * misses_a_line * reply_cycles(machine);
    let in_flight = (f64::from(occupancy.warps) * sms).min(totals.warps as f64);
    let again = if machine.sm.replay { totals.again as f64 + l1_misses } else { 0.0 };
    let issue =
        (totals.instructions.warp as f64 + again) / sms / f64::from(machine.sm.schedulers.min(machine.sm.fetch));
    let latency = (totals.cycles + totals.loads as f64 * waiting) / in_flight;
    let bandwidth = l2_misses * line_cycles(machine) / f64::from(machine.dram.channels);
    let longest = totals.longest + totals.longest_loads * waiting;
    let cycles = issue.max(latency).max(bandwidth).max(longest).ceil().max(1.0);

    let efficiency = totals.instructions.efficiency();
    let busy = issue.max(latency).max(bandwidth);
    let compute = ((totals.cycles / in_flight.max(1.0)) - issue).clamp(0.0, busy - issue);
    Ok(Part {
        stage: launch.stage,
        cycles,
        instructions: totals.instructions,
        visits: totals.visits,
        l1,
        l2,
        latency: latencies,
        occupancy,
        cpi: CpiStack {
            base: issue * efficiency,
            divergence: issue * (1.0 - efficiency),
            compute_data: compute,
            memory_data: busy - issue - compute,
            idle: cycles - busy,
            ..CpiStack::default()
        },
    })
}

fn totals(machine: &Machine, launch: &Launch) -> Totals {
    let costs = profile(machine, launch.kernel);
    let threads = u64::from(machine.sm.threads) * u64::from(machine.sms);
    let layout = Layout::new(&launch.workload, threads).requests_of(machine.l1.request);
    let mut totals = Totals::default();
    let mut batch = Batch::default();
    let warps = (0..launch.blocks()).flat_map(|block| (0..launch.warps_of(block)).map(move |warp| (block, warp)));
    for (block, warp) in warps {
        let first = (block * launch.block_threads() + warp * LANES) as u64;
        let mut warp = Warp::new(launch, layout, block, warp, first);
        totals.warps += 1;
        let (mut cycles, mut loads) = (0.0, 0.0);
        loop {
            warp.advance(&mut batch);
            if batch.segments.is_empty() {
                break;
            }
            for segment in &batch.segments {
                let cost = costs[segment.block as usize];
                cycles += cost.cycles as f64;
                totals.instructions.issue(cost.instructions, segment.lanes);
                totals.visits += u64::from(segment.block.visits());
            }
            for op in batch.memory.iter().filter(|op| op.access != Access::Texture) {
                let requests = u64::from(op.lines.1 - op.lines.0);
                totals.accesses += requests;
                totals.again += requests.saturating_sub(1);
            }
            let read = batch.memory.iter().any(|op| !op.access.writes());
            loads += f64::from(u8::from(read));
            totals.loads += u64::from(read);
            batch.lines.sort_unstable();
            batch.lines.dedup();
            batch.lines.iter().for_each(|&line| *totals.lines.entry(line).or_default() += 1);
        }
        totals.cycles += cycles;
        if cycles > totals.longest {
            (totals.longest, totals.longest_loads) = (cycles, loads);
        }
    }
    totals
}

/// Misses of an LRU cache of `capacity` lines whose lines are accessed `counts` times each, in no order: a line is
/// there if it was accessed within the characteristic time, in which the cache fills once.
fn missing(counts: &[f64], capacity: f64) -> f64 {
    let total: f64 = counts.iter().sum();
    let filled = |time: f64| counts.iter().map(|&n| 1.0 - (-n * time).exp()).sum::<f64>();
    if counts.len() as f64 <= capacity {
        return counts.iter().map(|&n| n.min(1.0)).sum();
    }
    let (mut low, mut high) = (0.0, 1.0);
    while filled(high) < capacity && high < 1e12 {
        high *= 2.0;
    }
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if filled(middle) < capacity { low = middle } else { high = middle }
    }
    counts.iter().map(|&n| n * (-n * high).exp()).sum::<f64>().min(total)
}
