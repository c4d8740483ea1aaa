//! The setting of strategy `migrate` with the fewest cycles when everything is charged, and what would have to change
//! for it to win.

use std::fmt::Write;

use rayon::prelude::*;
use serde::Serialize;

use super::chart::{Axis, Chart, Series, Style};
use super::experiment::{Migrate, Model, Recording};
use crate::bvh::{Owners, Partition, Policy};
use crate::fermi::launch::Stage;
use crate::fermi::plan::Grouping;
use crate::fermi::result::{Accounting, Prediction};
use crate::trace::Strategy;
use crate::{Error, Result};

/// Builds a model with these settings, as of `--set`, in addition to the user's.
pub type MakeModel<'a> = dyn Fn(&[String]) -> Result<Model> + Sync + 'a;

/// A setting of strategy `migrate`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Candidate {
    /// Where the tree is cut.
    #[serde(serialize_with = "as_text")]
    pub partition: Policy,
    /// Which multiprocessor gets which subtree.
    pub owners: Owners,
    /// Warps of a multiprocessor.
    pub warps: u32,
    /// Bytes of a ray's record.
    pub record: u32,
}

fn as_text<S: serde::Serializer>(policy: &Policy, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(policy)
}

/// A candidate and its cycles.
#[derive(Clone, Debug, Serialize)]
pub struct Tried {
    /// The setting.
    pub candidate: Candidate,
    /// Core cycles, everything charged.
    pub cycles: u64,
    /// Of them, making queues.
    pub queue_cycles: u64,
    /// Share of the multiprocessors' time in which they had nothing to do.
    pub idle: f64,
}

/// Gain of `migrate` over `direct`: its cycles over those of `migrate`.
#[derive(Clone, Debug, Serialize)]
pub struct Gain {
    /// What was changed.
    pub change: String,
    /// Direct over migrate; above 1, migration wins.
    pub gain: f64,
}

/// A point of a break-even curve.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Point {
    /// Bytes of the BVH over those of all first-level caches, or rays over subtrees.
    pub x: f64,
    /// Direct over migrate, everything charged.
    pub gain: f64,
    /// Direct over migrate, in the paper's accounting.
    pub paper_gain: f64,
}

/// What the search found.
#[derive(Clone, Debug, Serialize)]
pub struct Found {
    /// Cycles of strategy `direct`.
    pub direct_cycles: u64,
    /// All that was tried, in order.
    pub tried: Vec<Tried>,
    /// The best of it.
    pub best: Tried,
    /// What the best would gain if something were otherwise.
    pub changes: Vec<Gain>,
    /// Gain over BVH bytes per cache byte, by larger caches.
    pub over_cache: Vec<Point>,
    /// Gain over rays per subtree, by other cuts.
    pub over_rays: Vec<Point>,
}

/// Cuts that are tried, from few subtrees to many.
const PARTITIONS: [Policy; 8] = [
    Policy::Level(2),
    Policy::Level(4),
    Policy::Level(8),
    Policy::Bytes(4 << 20),
    Policy::Bytes(1 << 20),
    Policy::Bytes(256 << 10),
    Policy::Bytes(64 << 10),
    Policy::Sah(256 << 10),
];
/// Warps of a multiprocessor; the kernel's registers allow no more.
const WARPS: [u32; 4] = [2, 4, 8, 16];
/// Bytes of a record: as it is, and, as if rays could be packed, half of it and what one instruction moves.
const RECORDS: [u32; 3] = [64, 32, 16];
/// Capacities of the L1 along the curve, KiB: Fermi's two, and beyond any.
const CAPACITIES: [u64; 6] = [16, 48, 128, 512, 2048, 8192];

struct Search<'a> {
    make: &'a MakeModel<'a>,
    recording: &'a Recording,
    tried: Vec<Tried>,
}

/// Searches by changing one setting at a time as long as that helps; then asks what would have to change.
///
/// # Errors
/// [`Error::Usage`] if the tree cannot be cut or a kernel does not fit the machine.
pub fn search(make: &MakeModel, recording: &Recording) -> Result<Found> {
    let model = make(&[])?;
    let direct = model.whole(&recording.recorded(), Strategy::Direct)?;
    let mut search = Search { make, recording, tried: Vec::new() };
    let first = Candidate { partition: PARTITIONS[3], owners: Owners::Scattered, warps: WARPS[3], record: RECORDS[0] };
    let mut best = search.try_all(vec![first])?;
    loop {
        let before = best.candidate;
        best = search.try_all(PARTITIONS.map(|partition| Candidate { partition, ..best.candidate }).into())?;
        let owners = [Owners::Adjacent, Owners::Scattered];
        best = search.try_all(owners.map(|owners| Candidate { owners, ..best.candidate }).into())?;
        best = search.try_all(WARPS.map(|warps| Candidate { warps, ..best.candidate }).into())?;
        best = search.try_all(RECORDS.map(|record| Candidate { record, ..best.candidate }).into())?;
        if best.candidate == before {
            break;
        }
    }
    Ok(Found {
        direct_cycles: direct.cycles,
        changes: search.changes(&best, &direct)?,
        over_cache: search.over_cache(&best.candidate)?,
        over_rays: search.over_rays(&best.candidate, &direct)?,
        tried: search.tried,
        best,
    })
}

impl Search<'_> {
    /// Tries what is new of `candidates` and returns the best of all so far.
    fn try_all(&mut self, candidates: Vec<Candidate>) -> Result<Tried> {
        let new: Vec<Candidate> =
            candidates.into_iter().filter(|new| self.tried.iter().all(|old| old.candidate != *new)).collect();
        let tried = new.par_iter().map(|candidate| {
            let prediction = self.predict(candidate, &[], Accounting::Full)?;
            Ok(Tried {
                candidate: *candidate,
                cycles: prediction.cycles,
                queue_cycles: queue_cycles(&prediction),
                idle: prediction.cpi.idle / (prediction.cycles as f64).max(1.0),
            })
        });
        let tried = tried.collect::<Result<Vec<Tried>>>()?;
        self.tried.extend(tried);
        let best = self.tried.iter().min_by_key(|tried| tried.cycles);
        best.cloned().ok_or_else(|| Error::Check("nothing was tried".to_owned()))
    }

    fn predict(&self, candidate: &Candidate, settings: &[String], accounting: Accounting) -> Result<Prediction> {
        let Candidate { partition, owners, warps, record } = *candidate;
        let mut all = vec![format!("subtree.threads={}", 32 * warps), format!("subtree.record={record}")];
        all.extend(settings.iter().cloned());
        let migrate = Migrate { partition, owners, accounting, grouping: Grouping::Queued };
        (self.make)(&all)?.predict(self.recording, Strategy::Migrate, &migrate)
    }

    fn direct(&self, settings: &[String]) -> Result<Prediction> {
        (self.make)(settings)?.whole(&self.recording.recorded(), Strategy::Direct)
    }

    /// What the best setting would gain otherwise.
    fn changes(&self, best: &Tried, direct: &Prediction) -> Result<Vec<Gain>> {
        let over = |cycles: f64| direct.cycles as f64 / cycles.max(1.0);
        let gain = |change: &str, gain| Gain { change: change.to_owned(), gain };
        let without_queues = (best.cycles - best.queue_cycles) as f64;
        let at_work = without_queues * (1.0 - best.idle);
        let mut all = vec![
            gain("as it is", over(best.cycles as f64)),
            gain("queues for nothing", over(without_queues)),
            gain("queues for nothing, and no multiprocessor ever waits", over(at_work)),
        ];
        for record in RECORDS.into_iter().filter(|&record| record != best.candidate.record) {
            let candidate = Candidate { record, ..best.candidate };
            let cycles = self.predict(&candidate, &[], Accounting::Full)?.cycles;
            all.push(gain(&format!("records of {record} bytes"), over(cycles as f64)));
        }
        for kib in [48, 512] {
            let settings = larger_l1(kib);
            let (direct, migrate) =
                (self.direct(&settings)?, self.predict(&best.candidate, &settings, Accounting::Full)?);
            all.push(gain(
                &format!("an L1 of {kib} KiB, for both"),
                direct.cycles as f64 / migrate.cycles.max(1) as f64,
            ));
        }
        let paper = self.predict(&best.candidate, &[], Accounting::Paper)?;
        all.push(gain("the paper's accounting", over(paper.cycles as f64)));
        Ok(all)
    }

    fn over_cache(&self, best: &Candidate) -> Result<Vec<Point>> {
        let bytes = self.recording.bytes() as f64;
        let point = |&kib: &u64| {
            let settings = larger_l1(kib);
            let sms = (self.make)(&settings)?.machine.sms;
            let x = bytes / (f64::from(sms) * (kib * 1024) as f64);
            self.point(x, best, &settings)
        };
        CAPACITIES.par_iter().map(point).collect()
    }

    fn over_rays(&self, best: &Candidate, direct: &Prediction) -> Result<Vec<Point>> {
        let point = |&partition: &Policy| {
            let candidate = Candidate { partition, ..*best };
            let rays = self.recording.trace.rays() as f64;
            let subtrees = self.subtrees(&candidate)?;
            let gain = |p: Prediction| direct.cycles as f64 / p.cycles.max(1) as f64;
            Ok(Point {
                x: rays / subtrees as f64,
                gain: gain(self.predict(&candidate, &[], Accounting::Full)?),
                paper_gain: gain(self.predict(&candidate, &[], Accounting::Paper)?),
            })
        };
        let mut points = PARTITIONS.par_iter().map(point).collect::<Result<Vec<Point>>>()?;
        points.sort_by(|a, b| a.x.total_cmp(&b.x));
        Ok(points)
    }

    fn subtrees(&self, candidate: &Candidate) -> Result<usize> {
        let sms = (self.make)(&[])?.machine.sms;
        Ok(Partition::of(self.recording.hierarchy()?, candidate.partition, candidate.owners, sms)?.subtrees.len())
    }

    fn point(&self, x: f64, candidate: &Candidate, settings: &[String]) -> Result<Point> {
        let direct = self.direct(settings)?.cycles as f64;
        let gain = |accounting| -> Result<f64> {
            Ok(direct / self.predict(candidate, settings, accounting)?.cycles.max(1) as f64)
        };
        Ok(Point { x, gain: gain(Accounting::Full)?, paper_gain: gain(Accounting::Paper)? })
    }
}

/// An L1 of another size, with linear sets: the card's hash is of its two sizes only.
fn larger_l1(kib: u64) -> [String; 2] {
    [format!("l1.kib={kib}"), "l1.mapping=linear".to_owned()]
}

fn queue_cycles(prediction: &Prediction) -> u64 {
    prediction.stages.iter().filter(|stage| stage.stage == Stage::Queue).map(|stage| stage.cycles).sum()
}

/// For people.
pub fn table(found: &Found) -> String {
    let mut text = format!("direct: {} cycles\n\n", found.direct_cycles);
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "{:>14} {:>10} {:>6} {:>7} {:>12} {:>8} {:>7} {:>8}",
        "partition", "owners", "warps", "record", "cycles", "queues", "idle", "gain"
    );
    let line = |tried: &Tried| {
        let Candidate { partition, owners, warps, record } = tried.candidate;
        format!(
            "{:>14} {:>10} {warps:>6} {record:>7} {:>12} {:>7.1}% {:>6.1}% {:>8.3}\n",
            partition.to_string(),
            format!("{owners:?}").to_lowercase(),
            tried.cycles,
            100.0 * tried.queue_cycles as f64 / tried.cycles.max(1) as f64,
            100.0 * tried.idle,
            found.direct_cycles as f64 / tried.cycles.max(1) as f64
        )
    };
    found.tried.iter().for_each(|tried| text += &line(tried));
    text += &format!("\nbest:\n{}\n", line(&found.best));
    let verdict = if found.direct_cycles > found.best.cycles { "wins" } else { "loses" };
    let _ = writeln!(text, "Everything charged, migration {verdict} with the best setting. Its gain over direct");
    for Gain { change, gain } in &found.changes {
        let _ = writeln!(text, "  {gain:>7.3}  {change}");
    }
    for (name, points) in [("BVH bytes over L1 bytes", &found.over_cache), ("rays a subtree", &found.over_rays)] {
        let _ = writeln!(text, "\n{name:>24} {:>8} {:>20}", "gain", "paper's accounting");
        for point in points {
            let _ = writeln!(text, "{:>24.3} {:>8.3} {:>20.3}", point.x, point.gain, point.paper_gain);
        }
    }
    text
}

/// The break-even curves; migration wins above 1.
pub fn charts(found: &Found) -> Vec<Chart> {
    let chart = |title: &str, x: &str, points: &[Point]| {
        let line = |name: &str, of: fn(&Point) -> f64| {
            Series::new(name, Style::Line, points.iter().map(|point| (point.x, of(point))))
        };
        let ends = points.iter().map(|point| (point.x, 1.0));
        Chart {
            title: title.to_owned(),
            x: Axis::log(x, ""),
            y: Axis::log("cycles of direct over those of migrate", ""),
            series: vec![
                line("everything charged", |point| point.gain),
                line("the paper's accounting", |point| point.paper_gain),
                Series::new("break-even", Style::Line, ends),
            ],
            note: String::new(),
        }
    };
    vec![
        chart("Gain over cache size", "BVH bytes over bytes of all L1s", &found.over_cache),
        chart("Gain over subtrees", "rays a subtree", &found.over_rays),
    ]
}
