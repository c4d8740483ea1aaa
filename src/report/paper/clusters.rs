//! Figures 2 to 4: the conference room on more and more multiprocessors.

use serde::Serialize;

use super::jobs::Job;
use super::{RAYS, Request, published, scenes};
use crate::fermi::result::Prediction;

/// Most multiprocessors.
const MOST: u32 = 15;

/// The conference room on a number of multiprocessors: figures 2 to 4.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Cluster {
    /// Multiprocessors.
    pub sms: u32,
    /// `primary` or `secondary`.
    pub rays: &'static str,
    /// Million rays a second.
    pub mrays_per_s: f64,
    /// Mean cycles from an L1 miss to its line.
    pub latency: f64,
    /// Misses an L1 access.
    pub l1_miss: f64,
    /// Misses an L2 access.
    pub l2_miss: f64,
}

/// A run for each number of multiprocessors and each kind of rays.
pub(super) fn jobs(request: &Request) -> impl Iterator<Item = (&'static str, Job)> {
    let size = request.size;
    RAYS.into_iter().zip(scenes::batches(request.secondary)).flat_map(move |(rays, batch)| {
        let job = move |sms| Job { subject: published::CONFERENCE, batch, size, migrate: None, sms: Some(sms) };
        (1..=MOST).map(move |sms| (rays, job(sms)))
    })
}

impl Cluster {
    pub(super) fn of(rays: &'static str, job: &Job, prediction: &Prediction) -> Cluster {
        Cluster {
            sms: job.sms.unwrap_or_default(),
            rays,
            mrays_per_s: prediction.mrays_per_s,
            latency: prediction.latency.memory,
            l1_miss: prediction.l1.miss_rate,
            l2_miss: prediction.l2.miss_rate,
        }
    }
}
