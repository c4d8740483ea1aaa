//! How many samples a pixel gets: difference to a converged picture over time, by strategy.

use super::points::{Parameter, Point, Quantity, REPETITIONS, Topic, repeated};
use super::{Request, Steps, Subject};
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

/// Samples a pixel: powers of two.
fn ladder(request: &Request) -> Vec<u32> {
    let most = if request.quick { 4 } else { 64 };
    (0..=u32::ilog2(most)).map(|exponent| 1 << exponent).collect()
}

/// Things done by [`measure`] for one scene.
pub fn steps(request: &Request) -> usize {
    1 + Strategy::ALL.len() * ladder(request).len()
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
pub fn measure(request: &Request, gpu: Option<&Gpu>, subject: &Subject, steps: &Steps) -> Result<Vec<Point>> {
    let ladder = ladder(request);
    let most = ladder.iter().copied().max().unwrap_or(1);
    let studio = Studio { request, gpu, subject };
    let converged = studio.render(Strategy::Direct, REFERENCE_FACTOR * most, REFERENCE_SEED)?.film;
    let converged = converged.image(&[], false, Depth::Float)?;
    steps.done();
    let mut known: Vec<Repeated> = Vec::new();
    let mut points = Vec::new();
    for strategy in Strategy::ALL {
        // Compiles the strategy's kernels, which is not what is timed.
        studio.render(strategy, 1, 1)?;
        for (k, &spp) in ladder.iter().enumerate() {
            let (films, seconds) = studio.repeat(strategy, spp)?;
            match known.get(k) {
                Some(known) => same(subject, strategy, known, &films)?,
                None => known.push(Repeated::new(spp, films, &converged)?),
            }
            points.extend(known[k].points(subject, strategy, &seconds));
            steps.done();
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
        let runs = if spp <= MOST_REPEATED { REPETITIONS as u32 } else { 1 };
        let mut all = (Vec::new(), Vec::new());
        for seed in 1..=runs {
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
        let quantities = [(Quantity::Rmse, &self.rmse), (Quantity::Flip, &self.flip)];
        let point = |(quantity, values): (Quantity, &Vec<f64>)| {
            let (value, interval) = repeated(values)?;
            Some(Point {
                chart: Topic::Image,
                quantity,
                scene: subject.name.clone(),
                rays: "all",
                method: strategy.name().to_owned(),
                parameter: Some(Parameter { name: "spp", value: self.spp.into() }),
                seconds,
                value,
                reference: None,
                error: Some(value),
                interval,
                on_front: false,
                place: chart::Point { x: seconds, y: value, interval },
            })
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
