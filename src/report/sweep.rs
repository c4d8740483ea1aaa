//! One number of a machine or kernel changed step by step.

use std::fmt::Write;

use rayon::prelude::*;
use serde::Serialize;

use super::chart::{Axis, Chart, Series, Style};
use crate::fermi::result::Prediction;
use crate::{Error, Result};

/// Most values of a sweep.
const MOST_VALUES: usize = 1000;

/// A key and its values, from `sms=1..15`, `sms=1..15:2` or `l1.kib=16,48,128`.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    /// The key, as of `--set`.
    pub key: String,
    /// Its values, as of `--set`.
    pub values: Vec<String>,
}

/// The prediction at one value.
#[derive(Clone, Debug, Serialize)]
pub struct Step {
    /// The value.
    pub value: f64,
    /// What was predicted.
    pub prediction: Prediction,
}

impl std::str::FromStr for Sweep {
    type Err = Error;

    fn from_str(text: &str) -> Result<Sweep> {
        let bad = |problem: String| {
            Error::usage(
                format!("--sweep {text}: {problem}"),
                "write KEY=FIRST..LAST, KEY=FIRST..LAST:STEP or KEY=A,B,C",
            )
        };
        let (key, range) = text.split_once('=').ok_or_else(|| bad("there is no '='".to_owned()))?;
        let values = match range.split_once("..") {
            None => range.split(',').map(|value| value.trim().to_owned()).collect(),
            Some((first, rest)) => {
                let (last, step) = rest.split_once(':').unwrap_or((rest, "1"));
                let number = |text: &str| text.trim().parse::<u64>().map_err(|e| bad(format!("'{text}': {e}")));
                let (first, last, step) = (number(first)?, number(last)?, number(step)?);
                if step == 0 || last < first || (last - first) / step >= MOST_VALUES as u64 {
                    return Err(bad(format!("no range of 1 to {MOST_VALUES} values")));
                }
                (first..=last).step_by(step as usize).map(|value| value.to_string()).collect::<Vec<String>>()
            }
        };
        if values.len() > MOST_VALUES {
            return Err(bad(format!("more than {MOST_VALUES} values")));
        }
        if let Some(value) = values.iter().find(|value| !value.parse::<f64>().is_ok_and(f64::is_finite)) {
            return Err(bad(format!("'{value}' is no number")));
        }
        Ok(Sweep { key: key.trim().to_owned(), values })
    }
}

impl Sweep {
    /// Predicts at each value; `predict` takes the setting as of `--set`.
    ///
    /// # Errors
    /// Of the first value, in their order, that fails.
    pub fn run(&self, predict: impl Fn(String) -> Result<Prediction> + Sync) -> Result<Vec<Step>> {
        let step = |value: &String| -> Result<Step> {
            let prediction = predict(format!("{}={value}", self.key))?;
            // Parsing was checked when the sweep was made.
            Ok(Step { value: value.parse().unwrap_or(f64::NAN), prediction })
        };
        self.values.par_iter().map(step).collect::<Vec<_>>().into_iter().collect()
    }

    /// Speed, miss rates, latency and occupancy over the values.
    pub fn charts(&self, steps: &[Step]) -> Vec<Chart> {
        type Value = fn(&Prediction) -> f64;
        let line = |name: &str, of: Value| {
            Series::new(name, Style::Line, steps.iter().map(|step| (step.value, of(&step.prediction))))
        };
        let chart = |title: &str, y: Axis, series| Chart {
            title: title.to_owned(),
            x: Axis::linear(&self.key, ""),
            y,
            series,
            note: String::new(),
        };
        vec![
            chart("speed", Axis::linear("speed", "Mrays/s"), vec![line("speed", |p| p.mrays_per_s)]),
            chart(
                "misses",
                Axis::linear("misses an access", ""),
                vec![line("L1", |p| p.l1.miss_rate), line("L2", |p| p.l2.miss_rate)],
            ),
            chart("latency", Axis::linear("L1 miss to line", "cycles"), vec![line("mean", |p| p.latency.memory)]),
            chart(
                "occupancy",
                Axis::linear("warps", "a multiprocessor"),
                vec![line("resident", |p| f64::from(p.occupancy.warps))],
            ),
        ]
    }

    /// A line a value.
    pub fn table(&self, steps: &[Step]) -> String {
        let mut text = format!(
            "{:>12} {:>14} {:>10} {:>8} {:>8} {:>9} {:>6}\n",
            self.key, "cycles", "Mrays/s", "L1 miss", "L2 miss", "latency", "warps"
        );
        for Step { value, prediction: p } in steps {
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "{value:>12} {:>14} {:>10.2} {:>8.4} {:>8.4} {:>9.1} {:>6}",
                p.cycles, p.mrays_per_s, p.l1.miss_rate, p.l2.miss_rate, p.latency.memory, p.occupancy.warps
            );
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_and_lists_are_read() {
        let values = |text: &str| text.parse::<Sweep>().unwrap().values;
        assert_eq!(values("sms=1..3"), ["1", "2", "3"]);
        assert_eq!(values("sms=1..6:2"), ["1", "3", "5"]);
        assert_eq!(values("dram.mhz=462.0, 924.0"), ["462.0", "924.0"]);
    }

    #[test]
    fn what_is_no_range_is_refused() {
        for text in ["sms", "sms=", "sms=3..1", "sms=1..9:0", "sms=a..b", "sms=0..18446744073709551615", "sms=1,nan"] {
            assert_eq!(text.parse::<Sweep>().unwrap_err().exit_code(), 2, "{text}");
        }
    }
}
