//! A prediction for people.

use std::fmt::Write;

use crate::fermi::result::{CacheResult, Prediction};
use crate::fermi::sampled::Effort;

/// A prediction as a table.
pub fn table(p: &Prediction) -> String {
    let mut text =
        format!("{} on {}, fidelity {}, accounting {}\n", p.kernel, p.machine, name(&p.fidelity), name(&p.accounting));
    let mut line = |label: &str, value: String| {
        let _ = writeln!(text, "  {label:<18} {value}");
    };
    line("rays", p.rays.to_string());
    line("cycles", format!("{} of the core clock, {:.3} ms", p.cycles, p.seconds * 1e3));
    line("speed", format!("{:.2} Mrays/s", p.mrays_per_s));
    line("SIMD efficiency", format!("{:.4}", p.simd_efficiency));
    line("instructions", format!("{} of warps, {} of threads", p.instructions.warp, p.instructions.thread));
    line("L1", cache(&p.l1));
    line("L2", cache(&p.l2));
    line("latency", format!("{:.1} cycles a line fetched, {:.1} an access", p.latency.memory, p.latency.mean));
    let o = &p.occupancy;
    line("occupancy", format!("{} blocks, {} warps, limited by {}", o.blocks, o.warps, name(&o.limiter)));
    if let (Some(effort), Some([low, high])) = (&p.tolerance, p.interval) {
        line("95 % interval", format!("{low:.0} to {high:.0} cycles, {:.2} % either way", 100.0 * effort.reached));
        line("warps replayed", format!("{} of {}", effort.sampled_warps, effort.warps));
        for skipped in &effort.skipped {
            line("left out", format!("{}: {}", skipped.what, skipped.why));
        }
        let Effort { seconds_recording, seconds_model, saving_estimated, .. } = effort;
        let saving = match saving_estimated.is_finite() {
            true => format!("{saving_estimated:.1} times less than the full replay, by estimate"),
            false => "nothing was recorded or replayed".to_owned(),
        };
        line("cost", format!("{seconds_recording:.2} s of recording, {seconds_model:.2} s of modelling; {saving}"));
    }
    for (part, cycles) in p.cpi.parts() {
        line(part, format!("{cycles:>12.0} cycles {:>6.1} %", 100.0 * cycles / p.cpi.total().max(1.0)));
    }
    text
}

fn cache(c: &CacheResult) -> String {
    let n = &c.counts;
    let interval = c.interval.map_or(String::new(), |[low, high]| format!(" ({low:.4} to {high:.4})"));
    format!(
        "{} accesses, {} misses, {} pending hits, miss rate {:.4}{}, {:.4} a visit",
        n.accesses, n.misses, n.pending_hits, c.miss_rate, interval, c.miss_rate_per_visit
    )
}

/// The name that serde gives to a variant.
pub(super) fn name(value: &impl serde::Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
}
