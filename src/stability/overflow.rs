//! Counters and timers: sums beyond 32 bits, and clocks that wrap.

use super::naive::sum_u32;
use super::{Effort, Finding, Study, worst};
use crate::Result;
use crate::layout::RayCounters;
use crate::report::chart::{Axis, Chart, Series, Style};
use crate::trace::Totals;
use crate::vulkan::ticks_between;

/// Node visits of each ray: 16 rays reach 2^32.
const VISITS: u32 = 1 << 28;

/// Bits of a timer, as on many GPUs; Vulkan asks for 36 at least.
const TIMER_BITS: u32 = 36;

pub fn study(_effort: Effort) -> Result<Study> {
    let counts: Vec<usize> = (0..=8).map(|e| 1 << e).collect();
    let each = |sum: &dyn Fn(&[RayCounters]) -> f64| -> Vec<(f64, f64)> {
        let wrong = |&count: &usize| {
            let counters = vec![RayCounters { node_visits: VISITS, ..RayCounters::default() }; count];
            let truth = count as f64 * f64::from(VISITS);
            (truth, (sum(&counters) - truth).abs() / truth)
        };
        counts.iter().map(wrong).collect()
    };
    let narrow = each(&|counters| f64::from(sum_u32(counters)));
    let wide = each(&|counters| Totals::of(counters).node_visits as f64);
    // A span of 1000 ticks that begins so many ticks before the timer wraps.
    let spans: Vec<(f64, [f64; 2])> = (0..=12).map(|e| (f64::from(1 << e), timer(1 << e))).collect();
    let timer = |k: usize| -> Vec<(f64, f64)> { spans.iter().map(|(x, wrong)| (*x, wrong[k])).collect() };
    Ok(Study {
        about: "Node visits summed over rays, up to 2^36; and a span of 1000 ticks on a device timer of 36 bits, whose \
                upper bits are undefined and which wraps.",
        findings: vec![
            Finding {
                method: "counters",
                regime: "2^28 to 2^36 node visits in all".to_owned(),
                measure: "error of the sum, part of it",
                naive: "a sum in 32 bits",
                naive_failure: worst(&narrow),
                failure: worst(&wide),
                uses: "32 bits a ray, which no walk of a tree of 2^27 nodes fills, and 64 for sums (trace/accounting.rs)",
            },
            Finding {
                method: "timers",
                regime: "spans across the wrap of a timer of 36 bits".to_owned(),
                measure: "error of the span, part of it",
                naive: "the difference of both readings",
                naive_failure: worst(&timer(0)),
                failure: worst(&timer(1)),
                uses: "the difference modulo the timer's bits (vulkan/timestamps.rs)",
            },
        ],
        charts: vec![
            Chart {
                title: "Error of a sum of node visits".to_owned(),
                x: Axis::log("node visits", "in all"),
                y: Axis::linear("error", "part of the sum"),
                series: vec![
                    Series::new("32 bits", Style::Line, narrow),
                    Series::new("64 bits (this program)", Style::Line, wide),
                ],
                note: String::new(),
            },
            Chart {
                title: "Error of a span of 1000 ticks near the wrap".to_owned(),
                x: Axis::log("ticks before the wrap", ""),
                y: Axis::log("error", "part of the span"),
                series: vec![
                    Series::new("difference", Style::Line, timer(0)),
                    Series::new("modulo the timer's bits (this program)", Style::Line, timer(1)),
                ],
                note: format!("a timer of {TIMER_BITS} bits, garbage above"),
            },
        ],
    })
}

/// Relative errors of a span, by difference and as this program does.
fn timer(before: u64) -> [f64; 2] {
    const SPAN: u64 = 1000;
    let garbage = 0xABC << TIMER_BITS;
    let begin = (1u64 << TIMER_BITS) - before;
    let end = garbage | ((begin + SPAN) & ((1 << TIMER_BITS) - 1));
    let error = |ticks: u64| (ticks as f64 - SPAN as f64).abs() / SPAN as f64;
    [error(end.wrapping_sub(begin)), error(ticks_between(begin, end, TIMER_BITS))]
}
