//! Predictions of many runs, each made once.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::scenes::Subject;
use crate::Result;
use crate::fermi::result::Prediction;
use crate::render::rays::Batch;
use crate::report::experiment::{Migrate, Model, Recorded};
use crate::trace::Strategy;

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

/// What was predicted.
#[derive(Clone, Debug, Default)]
pub struct Predictions(Vec<(Job, Prediction)>);

impl Predictions {
    /// Predicts `jobs` with `model`, those of the same rays together; `done` hears of each that is finished.
    ///
    /// # Errors
    /// Of the first job that fails.
    pub fn of(
        model: &Model,
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
            let subject = &subjects[group[0].subject];
            let trace = subject.record(group[0].size, group[0].batch);
            let triangles = subject.bvh.triangle_count;
            let recorded = Recorded { trace: &trace, children: &subject.children, triangles };
            let predict = |job: Job| -> Result<(Job, Prediction)> {
                let prediction = predict(model, subject, &recorded, &job)?;
                done(finished.fetch_add(1, Ordering::Relaxed) + 1, total);
                Ok((job, prediction))
            };
            group.into_par_iter().map(predict).collect()
        };
        let groups = groups.into_par_iter().map(predict_group).collect::<Result<Vec<_>>>()?;
        Ok(Predictions(groups.into_iter().flatten().collect()))
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

fn predict(model: &Model, subject: &Subject, recorded: &Recorded, job: &Job) -> Result<Prediction> {
    let mut model = model.clone();
    model.machine.sms = job.sms.unwrap_or(model.machine.sms);
    match job.migrate {
        None => model.whole(recorded, Strategy::Direct),
        Some(migrate) => model.migrated(recorded, &subject.bvh, &migrate),
    }
}
