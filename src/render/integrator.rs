//! The wavefront: batches of pixels, samples, bounces, each a few small stages.

use super::film::Film;
use super::settings::Settings;
use super::stages::{RayCounts, Stages};
use crate::Result;
use crate::shared::*;
use crate::twin::tiles::{tile_count, tile_pixel};

/// What bounds the loop over lights and bounces.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Punctual lights.
    pub lights: u32,
    /// Ambient occlusion as one more light.
    pub ambient: bool,
    /// Paths can go on after their first hit.
    pub bounces: bool,
    /// Keep what the camera rays met.
    pub aovs: bool,
}

/// How far a picture is.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Camera rays done.
    pub done: u64,
    /// Camera rays in all.
    pub total: u64,
    /// Rays of all kinds traced.
    pub rays: u64,
}

/// Renders into a film; `report` is called now and then.
///
/// # Errors
/// Whatever a stage fails with.
pub fn render(
    stages: &mut dyn Stages,
    settings: &Settings,
    plan: Plan,
    report: &mut dyn FnMut(Progress),
) -> Result<(Film, RayCounts)> {
    let mut film = Film::new(settings.width, settings.height, plan.aovs);
    let mut counts = RayCounts::default();
    let pixels = u64::from(settings.width) * u64::from(settings.height);
    let total = pixels * u64::from(settings.spp);
    // Settings::check refuses pictures with more indices than 32 bits hold.
    let indices = tile_count(settings.width, settings.height).unwrap_or(u32::MAX);
    for first in (0..indices).step_by(stages.capacity() as usize) {
        let count = stages.capacity().min(indices - first);
        let live = (first..first + count).filter(|&i| inside(i, settings)).count() as u64;
        stages.begin(first, count);
        for sample in 0..settings.spp {
            sample_batch(stages, plan, settings, sample, &mut counts)?;
            counts[KIND_PRIMARY as usize] += live;
            let done = counts[KIND_PRIMARY as usize];
            report(Progress { done, total, rays: counts.iter().sum() });
        }
        let (colors, aovs) = stages.read(plan.aovs)?;
        film.put(first, &colors, &aovs);
    }
    Ok((film, counts))
}

fn inside(index: u32, settings: &Settings) -> bool {
    let (x, y) = tile_pixel(index, settings.width);
    x < settings.width && y < settings.height
}

fn sample_batch(
    stages: &mut dyn Stages,
    plan: Plan,
    settings: &Settings,
    sample: u32,
    counts: &mut RayCounts,
) -> Result<()> {
    stages.generate(sample)?;
    for bounce in 0..=settings.max_depth {
        stages.trace_closest()?;
        if plan.aovs && sample == 0 && bounce == 0 {
            stages.aov()?;
        }
        for light in 0..plan.lights {
            stages.light(light)?;
        }
        if plan.ambient {
            stages.light(LIGHT_AMBIENT)?;
        }
        stages.shade()?;
        if !plan.bounces {
            break;
        }
        let made = stages.take_ray_counts()?;
        counts.iter_mut().zip(made).for_each(|(sum, new)| *sum += new);
        if made[KIND_DIFFUSE as usize] + made[KIND_REFLECT as usize] + made[KIND_REFRACT as usize] == 0 {
            break;
        }
    }
    stages.resolve(sample + 1 == settings.spp)?;
    if !plan.bounces {
        counts.iter_mut().zip(stages.take_ray_counts()?).for_each(|(sum, new)| *sum += new);
    }
    Ok(())
}
