//! A prediction for people.

use std::fmt::Write;

use crate::fermi::result::{CacheResult, Prediction};

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
    for (part, cycles) in p.cpi.parts() {
        line(part, format!("{cycles:>12.0} cycles {:>6.1} %", 100.0 * cycles / p.cpi.total().max(1.0)));
    }
    text
}

fn cache(c: &CacheResult) -> String {
    let n = &c.counts;
    format!(
        "{} accesses, {} misses, {} pending hits, miss rate {:.4}, {:.4} a visit",
        n.accesses, n.misses, n.pending_hits, c.miss_rate, c.miss_rate_per_visit
    )
}

/// The name that serde gives to a variant.
pub(super) fn name(value: &impl serde::Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
}
