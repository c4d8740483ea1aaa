//! Predictions of many runs, each made once.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use serde::Serialize;

use super::Request;
use super::scenes::Subject;
use crate::Result;
use crate::fermi::kernel::Loops;
use crate::fermi::result::{Fidelity, Prediction};
use crate::fermi::simt::LANES;
use crate::layout::Ray;
use crate::render::rays::Batch;
use crate::report::experiment::{Migrate, Recorded, Traceable, Traversal};
use crate::trace::{StepTrace, Strategy};

/// A run to be predicted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Job {
    /// Number of the scene.
    pub subject: usize,
    /// The rays.
    pub batch: Batch,
    /// Pixels across and down.
    pub size: (u32, u32),
    /// Strategy `migrate` as given, or `direct`, the paper's standard.
    pub migrate: Option<Migrate>,
    /// Multiprocessors; those of the machine without a number.
    pub sms: Option<u32>,
}

/// Runs that were predicted in one way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Used {
    /// The way.
    pub fidelity: Fidelity,
    /// Runs.
    pub runs: usize,
    /// Warps that their rays make where they are launched.
    pub warps: u64,
    /// Those of them that were replayed.
    pub replayed: u64,
}

/// What was predicted.
#[derive(Clone, Debug, Default)]
pub struct Predictions(Vec<(Job, Prediction)>);

impl Predictions {
    /// Predicts `jobs` as `request` says, those of the same rays together; `done` hears of each that is finished.
    ///
    /// # Errors
    /// Of the first job that fails.
    pub fn of(
        request: &Request,
        subjects: &[Subject],
        mut jobs: Vec<Job>,
        done: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Predictions> {
        let mut unique: Vec<Job> = Vec::new();
        for job in jobs.drain(..) {
            if !unique.contains(&job) {
                unique.push(job);
            }
        }
        let total = unique.len();
        let finished = AtomicUsize::new(0);
        let mut groups: Vec<Vec<Job>> = Vec::new();
        for job in unique {
            let same = |other: &Job| (job.subject, job.batch, job.size) == (other.subject, other.batch, other.size);
            match groups.iter_mut().find(|group| same(&group[0])) {
                Some(group) => group.push(job),
                None => groups.push(vec![job]),
            }
        }
        // Rays of one group at a time and thread, so that few are in memory.
        let predict_group = |group: Vec<Job>| -> Result<Vec<(Job, Prediction)>> {
            let traced = Traced::new(&subjects[group[0].subject], &group[0]);
            let predict = |job: Job| -> Result<(Job, Prediction)> {
                let prediction = traced.predict(request, &job)?;
                done(finished.fetch_add(1, Ordering::Relaxed) + 1, total);
                Ok((job, prediction))
            };
            group.into_par_iter().map(predict).collect()
        };
        let groups = groups.into_par_iter().map(predict_group).collect::<Result<Vec<_>>>()?;
        Ok(Predictions(groups.into_iter().flatten().collect()))
    }

    /// How many runs were predicted how.
    pub fn used(&self) -> Vec<Used> {
        let mut all: Vec<Used> = Vec::new();
        for (_, prediction) in &self.0 {
            let fidelity = prediction.fidelity;
            let place = all.iter().position(|used| used.fidelity == fidelity).unwrap_or_else(|| {
                all.push(Used { fidelity, runs: 0, warps: 0, replayed: 0 });
                all.len() - 1
            });
            let whole = prediction.rays.div_ceil(LANES as u64);
            let effort = prediction.tolerance.as_ref();
            all[place].runs += 1;
            all[place].warps += whole;
            all[place].replayed += effort.map_or(whole, |effort| effort.sampled_warps as u64);
        }
        all.sort_by_key(|used| used.fidelity as u8);
        all
    }

    /// The prediction of `job`, which was among the jobs.
    ///
    /// # Panics
    /// If it was not.
    pub fn get(&self, job: &Job) -> &Prediction {
        let found = self.0.iter().find(|(known, _)| known == job);
        &found.expect("every job asked for was listed before").1
    }
}

/// Rays of a group of jobs, recorded if one wants them all.
struct Traced<'a> {
    subject: &'a Subject,
    batch: Batch,
    rays: Vec<Ray>,
    /// As rays alone take their steps, and as a speculative kernel's warps do.
    traces: [OnceLock<StepTrace>; 2],
}

impl<'a> Traced<'a> {
    fn new(subject: &'a Subject, job: &Job) -> Traced<'a> {
        Traced { subject, batch: job.batch, rays: subject.rays(job.size, job.batch), traces: Default::default() }
    }

    fn predict(&self, request: &Request, job: &Job) -> Result<Prediction> {
        let Traced { subject, batch, rays, traces } = self;
        let mut model = request.model.clone();
        model.machine.sms = job.sms.unwrap_or(model.machine.sms);
        let query = batch.kind.query();
        let rays = Traceable { traversal: Traversal::Scene(&subject.bvh, query), children: &subject.children, rays };
        if let (None, Some(sampling)) = (job.migrate, request.sampling) {
            return model.sampled(&rays, &sampling);
        }
        if request.sampling.is_some() {
            model.fidelity = Fidelity::Caches;
        }
        let loops = model.loops(job.migrate.is_some());
        let trace = &traces[usize::from(loops == Loops::SpeculativeWhileWhile)].get_or_init(|| rays.record(loops));
        let recorded = Recorded { trace, children: &subject.children, triangles: subject.bvh.references() };
        match job.migrate {
            None => model.whole(&recorded, Strategy::Direct),
            Some(migrate) => model.migrated(&recorded, subject.bvh.hierarchy(), &migrate),
        }
    }
}
