//! Predictions of many runs, each made once.

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
        let finished = std::sync::atomic::AtomicUsize::new(0);
        let mut predictions = Predictions::default();
        while let Some(&first) = unique.first() {
            let same = |job: &Job| (job.subject, job.batch, job.size) == (first.subject, first.batch, first.size);
            let (group, rest): (Vec<Job>, Vec<Job>) = unique.into_iter().partition(same);
            unique = rest;
            let subject = &subjects[first.subject];
            let trace = subject.record(first.size, first.batch);
            let triangles = subject.bvh.triangle_count;
            let recorded = Recorded { trace: &trace, children: &subject.children, triangles };
            let predict = |job: Job| -> Result<(Job, Prediction)> {
                let prediction = predict(model, subject, &recorded, &job)?;
                done(finished.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1, total);
                Ok((job, prediction))
            };
            predictions.0.extend(group.into_par_iter().map(predict).collect::<Result<Vec<_>>>()?);
        }
        Ok(predictions)
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
