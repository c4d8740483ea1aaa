//! Cache mapping: strides that are powers of two fill one set and leave the others empty.

use super::{Effort, Finding, Study, worst};
use crate::Result;
use crate::fermi::cache::{Cache, Lookup};
use crate::fermi::machine::{Machine, Mapping};
use crate::report::chart::{Axis, Chart, Series, Style};

pub fn study(_effort: Effort) -> Result<Study> {
    let machine = Machine::named("gtx480", &[])?;
    let (sets, ways) = (machine.l1.sets(), machine.l1.ways);
    let lines = sets * ways / 2;
    let strides: Vec<u64> = (0..=14).map(|e| 1 << e).collect();
    let curve = |mapping: Mapping, shift: u64| -> Vec<(f64, f64)> {
        let misses = |&stride: &u64| (stride as f64, second_pass((sets, ways, mapping), lines, stride + shift));
        strides.iter().map(misses).collect()
    };
    let (linear, hashed) = (curve(Mapping::Linear, 0), curve(Mapping::Hashed, 0));
    // Up to the stride at which lines differ in none of the bits that the hash reads.
    let near =
        |curve: &[(f64, f64)]| worst(&curve.iter().copied().filter(|point| point.0 <= 128.0).collect::<Vec<_>>());
    let far = |curve: &[(f64, f64)]| worst(&curve.iter().copied().filter(|point| point.0 > 128.0).collect::<Vec<_>>());
    let finding = |regime: &str, naive_failure, failure| Finding {
        method: "cache mapping",
        regime: regime.to_owned(),
        measure: "misses of the second pass over half a cache",
        naive: "set by the low bits of the line",
        naive_failure,
        failure,
        uses: "the hash of the real GF100 (Nugteren et al. 2014; fermi/cache.rs), default of gtx480",
    };
    Ok(Study {
        about: "Half as many lines as the L1 holds, a power of two apart, read twice: a cache that used all its sets would \
                have them all the second time. Beyond 128 lines the real part's hash fails too, and so does its model.",
        findings: vec![
            finding("strides of 1 to 128 lines", near(&linear), near(&hashed)),
            finding("strides of 256 to 16384 lines", far(&linear), far(&hashed)),
        ],
        charts: vec![Chart {
            title: "Misses of the second pass against the stride".to_owned(),
            x: Axis::log("stride", "lines"),
            y: Axis::linear("misses", "part of the accesses"),
            series: vec![
                Series::new("linear", Style::Line, linear),
                Series::new("hashed (this program)", Style::Line, hashed),
            ],
            note: format!("{sets} sets of {ways} ways, {lines} lines"),
        }],
    })
}

/// Miss rate of a second pass over `lines` lines, `stride` apart.
fn second_pass((sets, ways, mapping): (u64, u64, Mapping), lines: u64, stride: u64) -> f64 {
    let mut cache = Cache::new(sets, ways, mapping);
    let mut misses = 0;
    for (now, access) in (1..).zip(0..2 * lines) {
        match cache.look(access % lines * stride) {
            Lookup::Hit(way) | Lookup::Pending(way) => cache.touch(way, now),
            Lookup::Miss(way) => {
                cache.reserve(way, access % lines * stride, now);
                cache.fill(way);
                misses += u64::from(access >= lines);
            }
            // Nothing stays reserved.
            Lookup::Full => misses += 1,
        }
    }
    misses as f64 / lines as f64
}
