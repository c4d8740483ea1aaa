//! A run of the benchmark against an earlier one: counters and digests exactly, times by their intervals.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde::Deserialize;
use serde_json::Value;

use super::bench::{Report, SCHEMA};
use super::statistics::Median;
use crate::{Error, Result};

/// What tells rows of one report apart, and names them.
const KEYS: [&str; 8] = ["strategy", "nodes", "partition", "owners", "sms", "warps_per_sm", "hardware_sms", "rays"];

/// Format of nodes that goes without saying.
const FULL_NODES: &str = "full";

/// What must repeat exactly, on every machine.
const EXACT: [&str; 6] = ["ray_count", "hits", "hits_digest", "counters", "warps", "migration"];

/// Settings without which counters cannot be compared.
const SETTINGS: [&str; 7] =
    ["/scene/triangles", "/scene/bounds", "/width", "/height", "/ao_radius", "/seed", "/arithmetic"];

/// What times depend on besides the program.
const MACHINE: [&str; 3] = ["/machine/device", "/machine/host", "/machine/threads"];

/// Differing counters of a row that are printed; one cause changes many.
const SHOWN: usize = 6;

/// An earlier report, schema `caribou-bench/1`.
pub struct Baseline {
    path: PathBuf,
    report: Value,
}

/// A share: `2%` or `0.02`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Share(pub f64);

/// What became of the rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Comparison {
    /// Rows of the new run that changed.
    pub changed: Vec<RowChange>,
    /// Rows compared.
    pub rows: usize,
    /// Rows of the baseline that were not run.
    pub not_run: Vec<String>,
    /// Why times were not compared, if they were not.
    pub times_left_out: Option<String>,
}

/// How a row differs.
#[derive(Clone, Debug, PartialEq)]
pub struct RowChange {
    /// Strategy, its machine and the kind of rays.
    pub row: String,
    /// Name, old and new value of what should be equal.
    pub exact: Vec<[String; 3]>,
    /// How many times as long it takes, if that is certain and more than allowed; below 1 if it became faster.
    pub time: Option<f64>,
}

#[derive(Deserialize)]
struct Rate {
    mrays_per_s: Option<Median>,
}

impl Baseline {
    /// Reads a report.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Input`] if there is none, or one of another schema.
    pub fn read(path: &Path) -> Result<Baseline> {
        let text = std::fs::read_to_string(path).map_err(Error::io("read", path))?;
        let remedy = "give a file that caribou bench --json wrote";
        let report: Value = serde_json::from_str(&text)
            .map_err(|error| Error::input(path, "file", format!("no JSON: {error}"), remedy))?;
        let baseline = Baseline { path: path.to_path_buf(), report };
        if baseline.report["schema"] != SCHEMA {
            let problem = format!("it is {}, not \"{SCHEMA}\"", baseline.report["schema"]);
            return Err(Error::input(path, "schema", problem, remedy));
        }
        if !baseline.report["results"].is_array() {
            return Err(Error::input(path, "results", "they are missing", remedy));
        }
        Ok(baseline)
    }

    /// Refuses a baseline that `report`, of which the results may still be missing, cannot be compared with.
    ///
    /// # Errors
    /// [`Error::Input`] with the setting that differs.
    pub fn check(&self, report: &Report) -> Result<()> {
        let new = value(report);
        let differs = |what: &str, old: &Value, new: &Value| {
            let problem = format!("{what} is {old} there and {new} here");
            Err(Error::input(&self.path, "settings", problem, "run with the baseline's settings, or make a new one"))
        };
        let file = |report: &Value| -> Value {
            let name = report["scene"]["name"].as_str().unwrap_or_default();
            Path::new(name).file_name().unwrap_or_default().to_string_lossy().into_owned().into()
        };
        if file(&self.report) != file(&new) {
            return differs("the scene", &file(&self.report), &file(&new));
        }
        for setting in SETTINGS {
            let (old, new) = (at(&self.report, setting), at(&new, setting));
            // The seed was not always written.
            if old != new && !(setting == "/seed" && old.is_null()) {
                return differs(&setting[1..].replace('/', "."), old, new);
            }
        }
        Ok(())
    }

    /// Compares a finished report; a row is slower or faster if the intervals do not overlap and the medians differ by
    /// more than `allowed`.
    ///
    /// # Errors
    /// [`Error::Input`] if the baseline lacks a row.
    pub fn compare(&self, report: &Report, allowed: Share) -> Result<Comparison> {
        let new = value(report);
        let (old_rows, new_rows) = (rows(&self.report), rows(&new));
        let mut comparison = Comparison { times_left_out: self.other_machine(&new), ..Comparison::default() };
        for row in new_rows {
            let name = key(row);
            let Some(old) = old_rows.iter().find(|old| key(old) == name) else {
                let remedy = "choose --rays, --strategy and their settings as there, or make a new baseline";
                return Err(Error::input(&self.path, "results", format!("there is no row {name}"), remedy));
            };
            let mut exact = Vec::new();
            EXACT.iter().for_each(|part| differences(part, &old[part], &row[part], &mut exact));
            let time = if comparison.times_left_out.is_none() { self.time(old, row, allowed)? } else { None };
            comparison.rows += 1;
            if !exact.is_empty() || time.is_some() {
                comparison.changed.push(RowChange { row: name, exact, time });
            }
        }
        let run: Vec<String> = new_rows.iter().map(key).collect();
        comparison.not_run = old_rows.iter().map(key).filter(|name| !run.contains(name)).collect();
        Ok(comparison)
    }

    fn other_machine(&self, new: &Value) -> Option<String> {
        let describe = |report: &Value| MACHINE.map(|part| at(report, part).to_string()).join(", ");
        let (old, new) = (describe(&self.report), describe(new));
        (old != new).then(|| format!("the baseline is of another machine ({old}; here {new})"))
    }

    /// How many times as long the row takes, if it changed.
    fn time(&self, old: &Value, new: &Value, allowed: Share) -> Result<Option<f64>> {
        let rate = |row: &Value| {
            let rate = Rate::deserialize(row);
            let bad =
                |error: serde_json::Error| Error::input(&self.path, key(row), error.to_string(), "make a new one");
            rate.map(|rate| rate.mrays_per_s).map_err(bad)
        };
        Ok(rate(old)?.zip(rate(new)?).and_then(|(old, new)| changed_time(old, new, allowed)))
    }
}

/// Time by rays a second: how many times as long, if the intervals are apart and the medians too.
fn changed_time(old: Median, new: Median, Share(allowed): Share) -> Option<f64> {
    let ratio = old.median / new.median;
    let slower = new.high < old.low && ratio - 1.0 > allowed;
    let faster = new.low > old.high && 1.0 / ratio - 1.0 > allowed;
    (slower || faster).then_some(ratio)
}

impl Comparison {
    /// Whether counters are equal and nothing became slower.
    ///
    /// # Errors
    /// [`Error::Check`] with the number of rows that fail.
    pub fn judge(&self) -> Result<()> {
        let count = |fails: fn(&&RowChange) -> bool| self.changed.iter().filter(fails).count();
        let counters = count(|row| !row.exact.is_empty());
        let slower = count(|row| row.time.is_some_and(|ratio| ratio > 1.0));
        if counters + slower == 0 {
            return Ok(());
        }
        Err(Error::Check(format!(
            "of {} rows, counters or hits changed in {counters}, and {slower} became slower than the baseline",
            self.rows
        )))
    }

    /// The rows that changed.
    pub fn table(&self) -> String {
        let mut text = format!("\nbaseline: {} of {} rows changed\n", self.changed.len(), self.rows);
        for row in &self.changed {
            if let Some(ratio) = row.time {
                let word = if ratio > 1.0 { "slower" } else { "faster" };
                let _ = writeln!(text, "{}: {word}, {ratio:.3} times the time", row.row);
            }
            for [name, old, new] in row.exact.iter().take(SHOWN) {
                let _ = writeln!(text, "{}: {name} was {old}, is {new}", row.row);
            }
            if row.exact.len() > SHOWN {
                let _ = writeln!(text, "{}: and {} more", row.row, row.exact.len() - SHOWN);
            }
        }
        if let Some(reason) = &self.times_left_out {
            let _ = writeln!(text, "times were not compared: {reason}");
        }
        if !self.not_run.is_empty() {
            let _ = writeln!(text, "of the baseline, not run: {}", self.not_run.join(", "));
        }
        text
    }
}

/// The report as a reader of its file has it: as text, since a float has more digits in memory.
fn value(report: &Report) -> Value {
    // Cannot fail: reports are structs of numbers, texts and lists, with texts as keys.
    serde_json::to_string(report).ok().and_then(|text| serde_json::from_str(&text).ok()).unwrap_or_default()
}

fn at<'a>(report: &'a Value, pointer: &str) -> &'a Value {
    report.pointer(pointer).unwrap_or(&Value::Null)
}

fn rows(report: &Value) -> &[Value] {
    report["results"].as_array().map_or(&[], Vec::as_slice)
}

/// `migrate/bytes:64KiB/.../primary`.
fn key(row: &Value) -> String {
    // The format of nodes was not always written, and was full then.
    let parts = KEYS.iter().map(|name| &row[name]).filter(|part| !part.is_null() && *part != FULL_NODES);
    parts.map(|part| part.as_str().map_or(part.to_string(), str::to_owned)).collect::<Vec<_>>().join("/")
}

/// Appends name, old and new value of each part that differs.
fn differences(name: &str, old: &Value, new: &Value, found: &mut Vec<[String; 3]>) {
    match (old, new) {
        (Value::Object(a), Value::Object(b)) => {
            let names = a.keys().chain(b.keys().filter(|part| !a.contains_key(*part)));
            names.for_each(|part| differences(&format!("{name}.{part}"), &old[part], &new[part], found));
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            (0..a.len()).for_each(|i| differences(&format!("{name}[{i}]"), &a[i], &b[i], found));
        }
        (Value::Array(a), Value::Array(b)) => {
            found.push([format!("length of {name}"), a.len().to_string(), b.len().to_string()]);
        }
        _ if old != new => found.push([name.to_owned(), old.to_string(), new.to_string()]),
        _ => {}
    }
}

impl FromStr for Share {
    type Err = Error;

    fn from_str(text: &str) -> Result<Share> {
        let (number, scale) = text.trim().strip_suffix('%').map_or((text, 1.0), |number| (number, 0.01));
        match number.trim().parse::<f64>().map(|number| number * scale) {
            Ok(share) if (0.0..=1.0).contains(&share) => Ok(Share(share)),
            _ => Err(Error::usage(format!("'{text}' is no share"), "give one from 0 to 1, such as 0.02, or 2%")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_fractions_or_percent() {
        assert_eq!("2%".parse::<Share>().unwrap(), Share(0.02));
        assert_eq!("0.02".parse::<Share>().unwrap(), Share(0.02));
        assert_eq!("0".parse::<Share>().unwrap(), Share(0.0));
        for bad in ["", "%", "-1%", "2", "101%", "NaN", "inf", "two"] {
            assert_eq!(bad.parse::<Share>().unwrap_err().exit_code(), 2, "{bad}");
        }
    }

    #[test]
    fn times_change_only_beyond_intervals_and_allowance() {
        let rate = |low, median, high| Median { median, low, high };
        let old = rate(95.0, 100.0, 105.0);
        let changed = |new, allowed| changed_time(old, new, Share(allowed));
        assert_eq!(changed(rate(80.0, 90.0, 96.0), 0.02), None, "the intervals overlap");
        assert_eq!(changed(rate(79.0, 80.0, 81.0), 0.02), Some(1.25));
        assert_eq!(changed(rate(79.0, 80.0, 81.0), 0.3), None, "within the allowance");
        assert_eq!(changed(rate(199.0, 200.0, 201.0), 0.02), Some(0.5));
    }

    #[test]
    fn every_part_that_differs_is_named() {
        let old = serde_json::json!({"a": 1, "b": {"c": [1, 2]}, "d": [1], "gone": 0});
        let new = serde_json::json!({"a": 1, "b": {"c": [1, 3]}, "d": [1, 2], "new": 5});
        let mut found = Vec::new();
        differences("x", &old, &new, &mut found);
        let names: Vec<&str> = found.iter().map(|[name, ..]| name.as_str()).collect();
        assert_eq!(names, ["x.b.c[1]", "length of x.d", "x.gone", "x.new"]);
    }

    #[test]
    fn slower_rows_and_changed_counters_fail_and_faster_ones_do_not() {
        let judged = |exact, time| {
            let changed = vec![RowChange { row: "direct/primary".into(), exact, time }];
            Comparison { changed, rows: 1, ..Comparison::default() }.judge().is_ok()
        };
        assert!(judged(vec![], Some(0.5)));
        assert!(!judged(vec![], Some(1.5)));
        assert!(!judged(vec![["hits", "1", "2"].map(str::to_owned)], Some(0.5)));
        assert!(Comparison::default().judge().is_ok());
    }
}
