//! The wavefront: batches of pixels, samples, bounces, each a few small stages; and passes over the tiles that still
//! need samples.

use super::film::Film;
use super::noise::{Goal, SamplingSummary};
use super::settings::Settings;
use super::stages::{RayCounts, Stages};
use crate::Result;
use crate::shared::*;
use crate::twin::tiles::tile_count;

/// Rays are counted after so many lights: a device counts in 32 bits, and a batch has up to 2^20 paths.
const LIGHTS_COUNTED: u32 = 2048;

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
    /// Share that is done: of tiles with a noise target, of the time with a limit alone, else of camera rays.
    pub share: f64,
    /// What the share is of.
    pub unit: &'static str,
    /// Rays of all kinds traced.
    pub rays: u64,
}

/// A picture and what it took.
pub struct Rendered {
    /// The pixels.
    pub film: Film,
    /// Rays traced.
    pub rays: RayCounts,
    /// Samples and noise.
    pub sampling: SamplingSummary,
}

/// Renders until the goal of `settings` is reached; `seconds` is the time since the start, and `report` is called now
/// and then. The samples of a pixel do not depend on when others stop.
///
/// # Errors
/// Whatever a stage fails with.
pub fn render(
    stages: &mut dyn Stages,
    settings: &Settings,
    plan: Plan,
    seconds: &dyn Fn() -> f64,
    report: &mut dyn FnMut(Progress),
) -> Result<Rendered> {
    let (goal, film) = (settings.goal(), Film::new(settings.width, settings.height, plan.aovs));
    // Settings::check refuses pictures with more indices than 32 bits hold.
    let tiles = tile_count(settings.width, settings.height).unwrap_or(u32::MAX) / WARP;
    let mut run =
        Run { stages, settings, plan, goal, seconds, report, film, rays: RayCounts::default(), tiles, left: tiles };
    let mut active: Vec<u32> = (0..tiles).collect();
    let mut taken = 0;
    while !active.is_empty() && taken < goal.most && !goal.is_late(taken, seconds) {
        let pass = goal.pass(taken);
        run.pass(&active, taken, pass)?;
        taken += pass;
        active.retain(|&tile| !goal.is_met(taken, run.film.noise(tile)));
        run.left = active.len() as u32;
    }
    let Run { mut film, rays, .. } = run;
    let sampling = film.finish(&goal);
    Ok(Rendered { film, rays, sampling })
}

struct Run<'a> {
    stages: &'a mut dyn Stages,
    settings: &'a Settings,
    plan: Plan,
    goal: Goal,
    seconds: &'a dyn Fn() -> f64,
    report: &'a mut dyn FnMut(Progress),
    film: Film,
    rays: RayCounts,
    tiles: u32,
    left: u32,
}

impl Run<'_> {
    /// `count` samples from number `first` on of all active tiles, batch by batch.
    fn pass(&mut self, active: &[u32], first: u32, count: u32) -> Result<()> {
        self.stages.choose(active)?;
        let batch_tiles = (self.stages.capacity() / WARP) as usize;
        for (batch, tiles) in active.chunks(batch_tiles).enumerate() {
            let live = self.film.pixels(tiles);
            self.stages.begin((batch * batch_tiles) as u32 * WARP, tiles.len() as u32 * WARP);
            let mut done = 0;
            while done < count && !self.goal.is_late(first, self.seconds) {
                self.sample(first + done, done)?;
                self.rays[KIND_PRIMARY as usize] += live;
                done += 1;
                let progress = self.progress();
                (self.report)(progress);
            }
            if done > 0 {
                self.film.add(tiles, done, &self.stages.read(self.plan.aovs && first == 0)?);
            }
        }
        Ok(())
    }

    fn progress(&self) -> Progress {
        let rays = self.rays.iter().sum();
        let (share, unit) = match (self.goal.noise, self.goal.seconds) {
            (Some(_), _) => (1.0 - f64::from(self.left) / f64::from(self.tiles), "of tiles"),
            (None, Some(limit)) => ((self.seconds)() / limit.max(f64::MIN_POSITIVE), "of the time"),
            (None, None) => {
                let pixels = f64::from(self.settings.width) * f64::from(self.settings.height);
                (self.rays[KIND_PRIMARY as usize] as f64 / (pixels * f64::from(self.goal.most)), "of camera rays")
            }
        };
        Progress { share, unit, rays }
    }

    /// Sample number `index`, after `before` others of this pass.
    fn sample(&mut self, index: u32, before: u32) -> Result<()> {
        let plan = self.plan;
        self.stages.generate(index)?;
        for bounce in 0..=self.settings.max_depth {
            self.stages.trace_closest(bounce == 0)?;
            if plan.aovs && index == 0 && bounce == 0 {
                self.stages.aov()?;
            }
            for light in 0..plan.lights {
                self.stages.light(light, bounce == 0)?;
                if (light + 1).is_multiple_of(LIGHTS_COUNTED) {
                    self.count()?;
                }
            }
            if plan.ambient {
                self.stages.light(LIGHT_AMBIENT, false)?;
            }
            self.stages.shade()?;
            if !plan.bounces {
                break;
            }
            let made = self.count()?;
            if made[KIND_DIFFUSE as usize] + made[KIND_REFLECT as usize] + made[KIND_REFRACT as usize] == 0 {
                break;
            }
        }
        self.stages.resolve(before)?;
        if !plan.bounces {
            self.count()?;
        }
        Ok(())
    }

    /// Rays made since the last call, which are added to the sum.
    fn count(&mut self) -> Result<RayCounts> {
        let made = self.stages.take_ray_counts()?;
        self.rays.iter_mut().zip(made).for_each(|(sum, new)| *sum += new);
        Ok(made)
    }
}

#[cfg(test)]
mod tests;
