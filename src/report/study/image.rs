//! How many samples a pixel gets: difference to a converged picture over time, by strategy.

use std::time::Instant;

use super::plan::Plan;
use super::points::{Parameter, Point, Quantity, REPETITIONS, Row, Topic, repeated};
use super::{Request, Subject};
use crate::render::compare::{channel_differences, flip_of, total};
use crate::render::features::Features;
use crate::render::film::Film;
use crate::render::image::{Depth, Image};
use crate::render::picture::{self, Picture, picture};
use crate::render::settings::Settings;
use crate::report::chart;
use crate::trace::{Strategy, TracerOptions};
use crate::vulkan::Gpu;
use crate::{Error, Result};

/// The converged picture has so many times the samples of the best one: its own noise is then half of that one's.
const REFERENCE_FACTOR: u32 = 4;

/// Pictures of at most so many samples a pixel are repeated with other seeds, for an interval.
const MOST_REPEATED: u32 = 4;

/// Seed of the converged picture; the others count up from 1.
const REFERENCE_SEED: u32 = 1000;

/// Most samples a pixel where there is time, of a quick study, and where there is none.
const MOST: u32 = 64;
const MOST_QUICK: u32 = 4;
const LEAST: u32 = 4;

/// Samples a pixel: powers of two up to `most`.
fn ladder(most: u32) -> Vec<u32> {
    (0..=u32::ilog2(most)).map(|exponent| 1 << exponent).collect()
}

/// Pictures of so many samples.
fn runs(spp: u32) -> u32 {
    if spp <= MOST_REPEATED { REPETITIONS as u32 } else { 1 }
}

/// What a picture costs: seconds for itself, and for each sample a pixel.
#[derive(Clone, Copy, Debug)]
struct Cost {
    picture: f64,
    sample: f64,
}

impl Cost {
    /// From the seconds of pictures of one and of [`LEAST`] samples.
    fn of(one: f64, several: f64) -> Cost {
        let sample = ((several - one) / f64::from(LEAST - 1)).max(0.0);
        Cost { picture: (one - sample).max(0.0), sample }
    }

    fn seconds(&self, spp: u32) -> f64 {
        self.picture + self.sample * f64::from(spp)
    }

    /// Of all pictures of a ladder up to `most`.
    fn ladder(&self, most: u32) -> f64 {
        ladder(most).into_iter().map(|spp| f64::from(runs(spp)) * self.seconds(spp)).sum()
    }
}

/// Seconds of all pictures of ladders up to `most`, one a strategy, and of the converged picture, which the first makes.
fn expected(costs: &[Cost], most: u32) -> f64 {
    let converged = costs.first().map_or(0.0, |cost| cost.seconds(REFERENCE_FACTOR * most));
    costs.iter().map(|cost| cost.ladder(most)).sum::<f64>() + converged
}

/// Pictures that differ in their seeds.
struct Repeated {
    spp: u32,
    films: Vec<Film>,
    rmse: Vec<f64>,
    flip: Vec<f64>,
}

/// Differences to the converged picture of each strategy.
///
/// # Errors
/// [`Error::Device`] if the device fails, [`Error::Check`] if strategies give different pictures.
pub fn measure(request: &Request, gpu: Option<&Gpu>, subject: &Subject, plan: &mut Plan) -> Result<Vec<Point>> {
    let studio = Studio { request, gpu, subject };
    let most = studio.most(plan)?;
    let converged = studio.render(Strategy::Direct, REFERENCE_FACTOR * most, REFERENCE_SEED)?.film;
    let converged = converged.image(&[], false, Depth::Float)?;
    let mut known: Vec<Repeated> = Vec::new();
    let mut points = Vec::new();
    for strategy in Strategy::ALL {
        for (k, spp) in ladder(most).into_iter().enumerate() {
            let (films, seconds) = studio.repeat(strategy, spp)?;
            match known.get(k) {
                Some(known) => same(subject, strategy, known, &films)?,
                None => known.push(Repeated::new(spp, films, &converged)?),
            }
            points.extend(known[k].points(subject, strategy, &seconds));
        }
    }
    Ok(points)
}

/// Renders pictures of a scene.
struct Studio<'a> {
    request: &'a Request,
    gpu: Option<&'a Gpu>,
    subject: &'a Subject,
}

impl Studio<'_> {
    /// Most samples a pixel that there is time for.
    fn most(&self, plan: &mut Plan) -> Result<u32> {
        let seconds = |strategy, spp| -> Result<f64> {
            let start = Instant::now();
            self.render(strategy, spp, 1)?;
            Ok(start.elapsed().as_secs_f64())
        };
        let mut costs = Vec::new();
        for strategy in Strategy::ALL {
            // The first picture compiles the strategy's kernels.
            seconds(strategy, 1)?;
            costs.push(Cost::of(seconds(strategy, 1)?, seconds(strategy, LEAST)?));
        }
        let wanted = if self.request.quick { MOST_QUICK } else { MOST };
        let fitting = ladder(wanted).into_iter().rev().find(|&most| plan.affords(expected(&costs, most)));
        let most = fitting.unwrap_or(LEAST).max(LEAST);
        if most < wanted {
            let what = format!("{}: pictures of {} to {wanted} samples a pixel", self.subject.name, 2 * most);
            plan.leave_out(what, expected(&costs, wanted));
        }
        Ok(most)
    }

    fn render(&self, strategy: Strategy, spp: u32, seed: u32) -> Result<Picture> {
        let Subject { bvh, tables, camera, scene, .. } = self.subject;
        let request = picture::Request {
            bvh,
            tables,
            camera,
            settings: Settings { spp, seed, ..self.subject.settings(self.request.size) },
            features: Features::of(scene, None),
            aovs: false,
            tracing: TracerOptions { strategy, ..TracerOptions::default() },
        };
        picture(self.gpu, &request, &mut |_| {})
    }

    fn repeat(&self, strategy: Strategy, spp: u32) -> Result<(Vec<Film>, Vec<f64>)> {
        let mut all = (Vec::new(), Vec::new());
        for seed in 1..=runs(spp) {
            let picture = self.render(strategy, spp, seed)?;
            all.0.push(picture.film);
            all.1.push(picture.render_seconds);
        }
        Ok(all)
    }
}

impl Repeated {
    fn new(spp: u32, films: Vec<Film>, converged: &Image) -> Result<Repeated> {
        let (mut rmse, mut flip) = (Vec::new(), Vec::new());
        for film in &films {
            let image = film.image(&[], false, Depth::Float)?;
            rmse.push(total(&channel_differences(converged, &image)).rmse);
            let differences = flip_of(converged, &image).unwrap_or_default();
            flip.push(differences.iter().map(|&d| f64::from(d)).sum::<f64>() / differences.len().max(1) as f64);
        }
        Ok(Repeated { spp, films, rmse, flip })
    }

    fn points(&self, subject: &Subject, strategy: Strategy, seconds: &[f64]) -> Vec<Point> {
        let Some((seconds, _)) = repeated(seconds) else { return Vec::new() };
        let row = Row {
            chart: Topic::Image,
            scene: &subject.name,
            rays: "all",
            method: strategy.name().to_owned(),
            parameter: Some(Parameter { name: "spp", value: self.spp.into() }),
        };
        let quantities = [(Quantity::Rmse, &self.rmse), (Quantity::Flip, &self.flip)];
        let point = |(quantity, values): (Quantity, &Vec<f64>)| {
            let (value, interval) = repeated(values)?;
            let place = chart::Point { x: seconds, y: value, interval };
            Some(Point { error: Some(value), ..row.point(quantity, seconds, (value, interval), place) })
        };
        quantities.into_iter().filter_map(point).collect()
    }
}

/// All strategies find the same hits, so their pictures are the same to the last bit.
fn same(subject: &Subject, strategy: Strategy, known: &Repeated, films: &[Film]) -> Result<()> {
    let differing: u64 = known.films.iter().zip(films).map(|(a, b)| a.differing_pixels(b)).sum();
    if differing == 0 {
        return Ok(());
    }
    let Repeated { spp, .. } = known;
    let name = strategy.name();
    Err(Error::Check(format!("{}: {differing} pixels of strategy {name} differ at {spp} samples", subject.name)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cost_of_a_ladder_is_that_of_its_pictures() {
        let cost = Cost::of(3.0, 9.0);
        assert_eq!((cost.picture, cost.sample), (1.0, 2.0));
        // Six pictures each of 1, 2 and 4 samples, one of 8; the converged one has 32.
        assert_eq!(cost.ladder(8), 6.0 * (3.0 + 5.0 + 9.0) + 17.0);
        assert_eq!(expected(&[cost, cost], 8), 2.0 * cost.ladder(8) + 65.0);
        assert_eq!(Cost::of(3.0, 2.0).seconds(100), 3.0);
    }
}
