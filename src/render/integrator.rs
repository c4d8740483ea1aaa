//! The wavefront: batches of pixels, samples, bounces, each a few small stages.

use super::film::Film;
use super::settings::Settings;
use super::stages::{RayCounts, Stages};
use crate::Result;
use crate::shared::*;
use crate::twin::tiles::{tile_count, tile_pixel};

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

fn add(counts: &mut RayCounts, made: RayCounts) {
    counts.iter_mut().zip(made).for_each(|(sum, new)| *sum += new);
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
            if (light + 1).is_multiple_of(LIGHTS_COUNTED) {
                add(counts, stages.take_ray_counts()?);
            }
        }
        if plan.ambient {
            stages.light(LIGHT_AMBIENT)?;
        }
        stages.shade()?;
        if !plan.bounces {
            break;
        }
        let made = stages.take_ray_counts()?;
        add(counts, made);
        if made[KIND_DIFFUSE as usize] + made[KIND_REFLECT as usize] + made[KIND_REFRACT as usize] == 0 {
            break;
        }
    }
    stages.resolve(sample + 1 == settings.spp)?;
    if !plan.bounces {
        add(counts, stages.take_ray_counts()?);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::layout::AovPixel;

    /// Counts shadow rays in 32 bits, as devices do; each path makes one a light.
    #[derive(Default)]
    struct Counter {
        paths: u32,
        counted: u32,
        taken: u32,
    }

    impl Stages for Counter {
        fn capacity(&self) -> u32 {
            1 << 20
        }

        fn begin(&mut self, _first: u32, count: u32) {
            self.paths = count;
        }

        fn generate(&mut self, _sample: u32) -> Result<()> {
            Ok(())
        }

        fn trace_closest(&mut self) -> Result<()> {
            Ok(())
        }

        fn aov(&mut self) -> Result<()> {
            Ok(())
        }

        fn light(&mut self, _light: u32) -> Result<()> {
            self.counted = self.counted.wrapping_add(self.paths);
            Ok(())
        }

        fn shade(&mut self) -> Result<()> {
            Ok(())
        }

        fn resolve(&mut self, _last: bool) -> Result<()> {
            Ok(())
        }

        fn take_ray_counts(&mut self) -> Result<RayCounts> {
            let mut counts = RayCounts::default();
            counts[KIND_SHADOW as usize] = u64::from(self.counted.wrapping_sub(self.taken));
            self.taken = self.counted;
            Ok(counts)
        }

        fn read(&mut self, _aovs: bool) -> Result<(Vec<[f32; 4]>, Vec<AovPixel>)> {
            Ok((vec![[0.0; 4]; self.paths as usize], Vec::new()))
        }

        fn seconds(&self) -> BTreeMap<String, f64> {
            BTreeMap::new()
        }
    }

    #[test]
    fn rays_of_more_lights_than_a_device_can_count_are_counted() {
        let settings = Settings { width: 1024, height: 1024, spp: 1, ..Settings::default() };
        for lights in [1, 2048, 4095, 10_000] {
            let plan = Plan { lights, ambient: false, bounces: false, aovs: false };
            let (_, counts) = render(&mut Counter::default(), &settings, plan, &mut |_| {}).unwrap();
            assert_eq!(counts[KIND_SHADOW as usize], u64::from(lights) << 20);
        }
    }
}
