//! Passes, tiles and time, with stages that trace nothing and a clock that they turn.

use std::cell::Cell;
use std::collections::BTreeMap;

use super::*;
use crate::render::film::Batch;
use crate::render::noise::LEAST_SAMPLES;

/// Samples of odd tiles alternate between 0.5 + and 0.5 - this.
const AMPLITUDE: f32 = 0.2;

/// Each sample takes a second. Shadow rays, one a path and light, are counted in 32 bits, as on devices.
struct Fake<'a> {
    counted: u32,
    taken: u32,
    capacity: u32,
    tiles: Vec<u32>,
    batch: (usize, usize),
    samples: Vec<u32>,
    seconds: &'a Cell<f64>,
}

impl<'a> Fake<'a> {
    fn new(capacity: u32, seconds: &'a Cell<f64>) -> Fake<'a> {
        Fake { counted: 0, taken: 0, capacity, tiles: vec![], batch: (0, 0), samples: vec![], seconds }
    }

    fn pixel(&self, tile: u32) -> ([f32; 4], f32) {
        let amplitude = if tile % 2 == 1 { AMPLITUDE } else { 0.0 };
        let values = self.samples.iter().map(|sample| if sample % 2 == 0 { 0.5 + amplitude } else { 0.5 - amplitude });
        let (sum, n) = (values.clone().sum::<f32>(), self.samples.len() as f32);
        ([sum; 4], values.map(|value| (value - sum / n).powi(2)).sum())
    }
}

impl Stages for Fake<'_> {
    fn capacity(&self) -> u32 {
        self.capacity
    }
    fn choose(&mut self, tiles: &[u32]) -> Result<()> {
        self.tiles = tiles.to_vec();
        Ok(())
    }
    fn begin(&mut self, first: u32, count: u32) {
        self.batch = ((first / WARP) as usize, (count / WARP) as usize);
        self.samples.clear();
    }
    fn generate(&mut self, sample: u32) -> Result<()> {
        self.samples.push(sample);
        self.seconds.set(self.seconds.get() + 1.0);
        Ok(())
    }
    fn trace_closest(&mut self, _coherent: bool) -> Result<()> {
        Ok(())
    }
    fn aov(&mut self) -> Result<()> {
        Ok(())
    }
    fn light(&mut self, _light: u32, _coherent: bool) -> Result<()> {
        self.counted = self.counted.wrapping_add(self.batch.1 as u32 * WARP);
        Ok(())
    }
    fn shade(&mut self) -> Result<()> {
        Ok(())
    }
    fn resolve(&mut self, before: u32) -> Result<()> {
        assert_eq!(before as usize + 1, self.samples.len());
        Ok(())
    }
    fn take_ray_counts(&mut self) -> Result<RayCounts> {
        let mut counts = RayCounts::default();
        counts[KIND_SHADOW as usize] = u64::from(self.counted.wrapping_sub(self.taken));
        self.taken = self.counted;
        Ok(counts)
    }
    fn read(&mut self, _aovs: bool) -> Result<Batch> {
        let mut batch = Batch::default();
        for &tile in &self.tiles[self.batch.0..][..self.batch.1] {
            let (sum, spread) = self.pixel(tile);
            batch.sums.extend([sum; WARP as usize]);
            batch.spreads.extend([spread; WARP as usize]);
        }
        Ok(batch)
    }
    fn seconds(&self) -> BTreeMap<String, f64> {
        BTreeMap::new()
    }
}

/// Ten tiles.
fn rendered(capacity: u32, spp: u32, noise_target: Option<f32>, time_limit: Option<f64>) -> Rendered {
    let settings = Settings { width: 40, height: 8, spp, noise_target, time_limit, ..Settings::default() };
    let clock = Cell::new(0.0);
    let mut fake = Fake::new(capacity, &clock);
    let plan = Plan { lights: 0, ambient: false, bounces: false, aovs: false };
    let mut shares = Vec::new();
    let report = &mut |progress: Progress| shares.push(progress.share);
    let rendered = render(&mut fake, &settings, plan, &|| clock.get(), report).unwrap();
    assert!(shares.is_sorted(), "progress goes on: {shares:?}");
    rendered
}

#[test]
fn quiet_tiles_stop_and_noisy_ones_go_on() {
    let target = 0.005;
    let Rendered { film, rays, sampling } = rendered(1 << 10, 1000, Some(target), None);
    let samples = film.samples_of_pixels();
    assert_eq!((samples[0], sampling.min), (LEAST_SAMPLES, LEAST_SAMPLES));
    // Variance over n, by the slope of the displayed value at 0.5.
    let slope = 0.5 / (0.5f64.sqrt() * 1.5f64.powf(1.5));
    let needed = (f64::from(AMPLITUDE) * slope / f64::from(target)).powi(2);
    let noisy = f64::from(samples[8]);
    assert!(noisy >= needed && noisy <= 1.4 * needed + 1.0, "{noisy} samples for {needed}");
    assert_eq!((sampling.tiles, sampling.tiles_done, sampling.max), (10, 10, samples[8]));
    assert!(sampling.worst_noise.unwrap() <= f64::from(target));
    let taken: u64 = samples.iter().map(|&n| u64::from(n)).sum();
    assert_eq!(rays[KIND_PRIMARY as usize], taken, "samples that were not needed were not traced");
    assert!((sampling.saved - (1.0 - taken as f64 / (320.0 * noisy))).abs() < 1e-12);
}

#[test]
fn batches_do_not_change_the_picture() {
    let whole = rendered(1 << 10, 200, Some(0.01), None);
    for capacity in [WARP, 3 * WARP] {
        let parts = rendered(capacity, 200, Some(0.01), None);
        assert_eq!(parts.film.differing_pixels(&whole.film), 0);
        assert_eq!(parts.rays, whole.rays);
    }
}

#[test]
fn a_target_out_of_reach_ends_at_the_most_samples() {
    let sampling = rendered(1 << 10, 50, Some(1e-6), None).sampling;
    assert_eq!((sampling.max, sampling.min), (50, LEAST_SAMPLES));
    assert_eq!((sampling.tiles_done, sampling.tiles), (5, 10));
}

#[test]
fn the_time_limit_ends_the_picture_but_every_pixel_has_a_sample() {
    let of = |capacity, limit| rendered(capacity, 1000, None, Some(limit)).sampling;
    for capacity in [1 << 10, 3 * WARP] {
        assert_eq!((of(capacity, 0.0).min, of(capacity, 0.0).max), (1, 1));
    }
    let ten = of(1 << 10, 10.0);
    assert_eq!((ten.min, ten.max), (10, 10));
    // Four batches, a second each: the last round is cut in the middle.
    let cut = of(3 * WARP, 10.0);
    assert_eq!((cut.min, cut.max), (2, 3));
    let both = rendered(1 << 10, 1000, Some(0.01), Some(20.0)).sampling;
    assert_eq!((both.max, both.tiles_done), (20, 5));
}

#[test]
fn without_a_goal_all_pixels_get_all_samples() {
    let Rendered { rays, sampling, .. } = rendered(3 * WARP, 7, None, None);
    assert_eq!((sampling.min, sampling.max, sampling.saved), (7, 7, 0.0));
    assert_eq!((rays[KIND_PRIMARY as usize], sampling.tiles_done), (7 * 320, 10));
}

#[test]
fn rays_of_more_lights_than_a_device_can_count_are_counted() {
    let settings = Settings { width: 1024, height: 1024, spp: 1, ..Settings::default() };
    for lights in [1, 2048, 4095, 10_000] {
        let plan = Plan { lights, ambient: false, bounces: false, aovs: false };
        let clock = Cell::new(0.0);
        let mut fake = Fake::new(1 << 20, &clock);
        let rendered = render(&mut fake, &settings, plan, &|| clock.get(), &mut |_| {}).unwrap();
        assert_eq!(rendered.rays[KIND_SHADOW as usize], u64::from(lights) << 20);
    }
}
