//! How rays are traced: time and node visits over bytes of nodes, by strategy and format of nodes.

use super::points::{Parameter, Point, Quantity, REPETITIONS, Row, Topic, repeated};
use super::{KINDS, Request, Subject};
use crate::report::bench::{Bench, GpuBench, Outcome, TwinBench, measure as measure_rays};
use crate::report::chart;
use crate::trace::TracerOptions;
use crate::vulkan::Gpu;
use crate::{Error, Result};

/// Speed and node visits of each way to trace.
///
/// # Errors
/// [`Error::Device`] if the device fails, [`Error::Check`] if hits differ between ways.
pub fn measure(request: &Request, gpu: Option<&Gpu>, subject: &Subject) -> Result<Vec<Point>> {
    let (frame, scene) = (subject.frame(request.size), (&subject.bvh, &subject.tables));
    let mut points = Vec::new();
    let mut digests: Vec<Vec<(String, String)>> = vec![Vec::new(); KINDS.len()];
    for options in TracerOptions::all() {
        let mut bench: Box<dyn Bench> = match gpu {
            Some(gpu) => Box::new(GpuBench::new(gpu, scene, frame, &options)?),
            None => Box::new(TwinBench::new(scene, frame, &options)?),
        };
        for (kind, digests) in KINDS.into_iter().zip(&mut digests) {
            let rays = bench.rays(kind)?;
            let (outcome, _) = measure_rays(bench.as_mut(), &options, kind, &rays, REPETITIONS)?;
            digests.push((options.name(), outcome.hits_digest.clone()));
            points.extend(points_of(subject, &options, &outcome));
        }
    }
    let rays = KINDS.iter().zip(&digests);
    rays.into_iter().try_for_each(|(kind, digests)| identical(&subject.name, kind.name(), digests))?;
    Ok(points)
}

/// Refuses methods, given with the digests of their hits, that disagree with the first.
fn identical(scene: &str, rays: &str, digests: &[(String, String)]) -> Result<()> {
    let Some((first, expected)) = digests.first() else { return Ok(()) };
    match digests.iter().find(|(_, digest)| digest != expected) {
        None => Ok(()),
        Some((method, digest)) => Err(Error::Check(format!(
            "{scene}, {rays} rays: hits of {method} ({digest}) differ from those of {first} ({expected})"
        ))),
    }
}

fn points_of(subject: &Subject, options: &TracerOptions, outcome: &Outcome) -> Vec<Point> {
    let bytes = (subject.bvh.nodes.len() * options.nodes.node_bytes()) as f64;
    let rays = outcome.ray_count as f64;
    let Some(((seconds, _), rate)) = repeated(&outcome.seconds).zip(outcome.mrays_per_s) else {
        return Vec::new();
    };
    let visits = outcome.counters.node_visits as f64 / rays;
    // A chart of what is to be small shows nanoseconds a ray in place of rays a second.
    let time = |rate: f64| 1e3 / rate;
    let mib = bytes / f64::from(1 << 20);
    let slowness = chart::Point { x: mib, y: time(rate.median), interval: Some([time(rate.high), time(rate.low)]) };
    let row = Row {
        chart: Topic::Traversal,
        scene: &subject.name,
        rays: outcome.rays.name(),
        method: options.name(),
        parameter: Some(Parameter { name: "node_bytes", value: bytes }),
    };
    vec![
        row.point(Quantity::MraysPerS, seconds, (rate.median, Some([rate.low, rate.high])), slowness),
        row.point(Quantity::NodeVisitsPerRay, seconds, (visits, None), (mib, visits).into()),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hits_that_differ_are_a_failed_check_that_names_both_methods() {
        let digests = |last: &'static str| [("direct", "a"), ("persistent", "a"), ("migrate", last)];
        let check = |last| identical("room", "ao", &digests(last).map(|(m, d)| (m.to_owned(), d.to_owned())));
        check("a").unwrap();
        let error = check("b").unwrap_err();
        assert_eq!(error.exit_code(), 1);
        assert!(error.to_string().contains("hits of migrate (b) differ from those of direct (a)"), "{error}");
    }
}
