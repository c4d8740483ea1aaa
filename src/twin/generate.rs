//! Twin of `generate.comp`: camera rays and fresh paths.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::exact::exact_rcp;
use super::random::random2;
use super::tiles::tile_pixel;
use super::vec::{floored3, normalize3};
use crate::layout::{Frame, Path, Ray, StagePush};
use crate::shared::{COORDINATE_FLOOR, DIMENSION_CAMERA, FAR_AWAY, WARP};

fn film_position(frame: &Frame, pixel: (u32, u32), id: u32, sample: u32) -> Vec2 {
    let jitter = if sample == 0 { Vec2::splat(0.5) } else { random2(frame.seed, id, DIMENSION_CAMERA, sample) };
    let x = (pixel.0 as f32 + jitter.x) * exact_rcp(frame.width as f32);
    let y = (pixel.1 as f32 + jitter.y) * exact_rcp(frame.height as f32);
    Vec2::new(x * 2.0 - 1.0, 1.0 - y * 2.0)
}

fn camera_ray(frame: &Frame, p: Vec2) -> Ray {
    let [origin, right, up, forward] =
        [frame.camera_origin, frame.camera_right, frame.camera_up, frame.camera_forward].map(Vec3::from);
    let across = right * p.x + up * p.y;
    let (origin, direction) = match frame.orthographic {
        0 => (origin, normalize3(forward + across)),
        _ => (origin + across, forward),
    };
    let origin = floored3(origin, COORDINATE_FLOOR).into();
    Ray { origin, t_min: 0.0, direction: direction.into(), t_max: FAR_AWAY }
}

/// Fills `rays` and `paths` with one sample of a batch of the pixels of `tiles`.
pub fn generate(frame: &Frame, push: StagePush, tiles: &[u32], rays: &mut [Ray], paths: &mut [Path]) {
    rays.par_iter_mut().zip(paths).enumerate().for_each(|(i, (ray, path))| {
        let place = push.first + i as u32;
        let pixel = tile_pixel(tiles[(place / WARP) as usize] * WARP + place % WARP, frame.width);
        let id = pixel.1.wrapping_mul(frame.width).wrapping_add(pixel.0);
        *ray = camera_ray(frame, film_position(frame, pixel, id, push.sample_index));
        if pixel.0 >= frame.width || pixel.1 >= frame.height {
            ray.t_max = -1.0;
        }
        *path = Path { throughput: [1.0; 3], pixel: id, radiance: [0.0; 3], state: 0 };
    });
}
