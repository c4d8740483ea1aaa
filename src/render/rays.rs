//! The rays that benchmarks trace: the same on every device and on the CPU.

use std::ops::Range;
use std::str::FromStr;

use glam::Vec3;

use super::gpu_scene::GpuScene;
use crate::bvh::Bvh;
use crate::layout::{Frame, Hit, Path, Ray, StagePush};
use crate::scene::tables::Tables;
use crate::shared::*;
use crate::trace::tracer::exactness;
use crate::trace::{Query, RayBuffers, Stream, Tracer};
use crate::twin;
use crate::twin::surface::Stage;
use crate::twin::tiles::tile_count;
use crate::vulkan::{Gpu, Kernel, Place};
use crate::{Error, Result};

/// Rays made at a time.
const CHUNK: u32 = 1 << 18;

/// Kind of a benchmark's rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum RayKind {
    /// Camera rays.
    Primary,
    /// One cosine-weighted ray of limited length from each hit of a camera ray; any hit ends it.
    Ao,
    /// One cosine-weighted ray from each hit.
    Diffuse,
    /// One mirrored ray from each hit.
    Reflect,
}

impl RayKind {
    /// All kinds.
    pub const ALL: [RayKind; 4] = [RayKind::Primary, RayKind::Ao, RayKind::Diffuse, RayKind::Reflect];

    /// Name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            RayKind::Primary => "primary",
            RayKind::Ao => "ao",
            RayKind::Diffuse => "diffuse",
            RayKind::Reflect => "reflect",
        }
    }

    /// What is asked of such rays.
    pub fn query(self) -> Query {
        if self == RayKind::Ao { Query::Any } else { Query::Closest }
    }

    /// Whether rays that follow each other go much the same way.
    pub fn coherent(self) -> bool {
        matches!(self, RayKind::Primary | RayKind::Reflect)
    }

    fn code(self) -> u32 {
        match self {
            RayKind::Primary => KIND_PRIMARY,
            RayKind::Ao => KIND_AO,
            RayKind::Diffuse => KIND_DIFFUSE,
            RayKind::Reflect => KIND_REFLECT,
        }
    }
}

/// Pieces of the pixels in tile order.
fn chunks(pixels: Range<u32>, kind: RayKind) -> impl Iterator<Item = StagePush> {
    let end = pixels.end;
    pixels.step_by(CHUNK as usize).map(move |first| StagePush {
        first,
        count: CHUNK.min(end - first),
        sample_index: 0,
        argument: kind.code(),
    })
}

/// Pixels in tile order, padding included.
fn pixels(frame: &Frame) -> Range<u32> {
    0..tile_count(frame.width, frame.height).unwrap_or(0)
}

fn all_tiles(frame: &Frame) -> Vec<u32> {
    (0..pixels(frame).end / WARP).collect()
}

/// Live rays of `kind` in tile order, made by the twins.
pub fn twin_rays(bvh: &Bvh, tables: &Tables, frame: &Frame, kind: RayKind) -> Vec<Ray> {
    twin_batch(bvh, tables, frame, Batch { kind, per_hit: 1, sorted: false })
}

/// Rays that are traced together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Batch {
    /// Their kind.
    pub kind: RayKind,
    /// Rays from each hit of a camera ray; camera rays are one a pixel. Mirrored rays from a hit are all the same.
    pub per_hit: u32,
    /// In the order of a space-filling curve, as Aila and Laine (2009, section 2) sort theirs.
    pub sorted: bool,
}

/// Part `number`, counted from 1, of `of` equal parts of a picture's tiles: what a benchmark launches at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    number: u32,
    of: u32,
}

impl Part {
    /// The whole picture.
    pub const WHOLE: Part = Part { number: 1, of: 1 };

    fn of(self, pixels: Range<u32>) -> Range<u32> {
        let tiles = u64::from(pixels.end / WARP);
        let bound = |part: u32| (tiles * u64::from(part) / u64::from(self.of)) as u32 * WARP;
        bound(self.number - 1)..bound(self.number)
    }
}

impl FromStr for Part {
    type Err = Error;

    fn from_str(text: &str) -> Result<Part> {
        let numbers = text.split_once('/').and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)));
        match numbers {
            Some((number, of)) if (1..=of).contains(&number) => Ok(Part { number, of }),
            _ => Err(Error::usage(format!("--part {text}"), "write K/N with K from 1 to N, such as 3/24")),
        }
    }
}

/// Live rays of `batch` in tile order, those of a hit side by side, or sorted; made by the twins.
pub fn twin_batch(bvh: &Bvh, tables: &Tables, frame: &Frame, batch: Batch) -> Vec<Ray> {
    twin_part(bvh, tables, frame, batch, Part::WHOLE)
}

/// Those rays of [`twin_batch`] that come from a part of the picture, sorted among themselves.
pub fn twin_part(bvh: &Bvh, tables: &Tables, frame: &Frame, batch: Batch, part: Part) -> Vec<Ray> {
    let Batch { kind, per_hit, sorted } = batch;
    let tiles = all_tiles(frame);
    let mut all = Vec::new();
    for push in chunks(part.of(pixels(frame)), kind) {
        let mut rays = vec![Ray::DEAD; push.count as usize];
        let mut paths: Vec<Path> = vec![bytemuck::Zeroable::zeroed(); rays.len()];
        twin::generate::generate(frame, push, &tiles, &mut rays, &mut paths);
        if kind != RayKind::Primary {
            let (hits, _) = twin::trace::trace_closest(bvh, &rays);
            let sample = |sample_index| {
                let mut secondary = vec![Ray::DEAD; rays.len()];
                let push = StagePush { sample_index, ..push };
                twin::secondary::secondary(Stage { bvh, tables, frame }, push, &rays, &hits, &mut secondary);
                secondary
            };
            let samples: Vec<Vec<Ray>> = (0..per_hit).map(sample).collect();
            rays = (0..rays.len()).flat_map(|i| samples.iter().map(move |rays| rays[i])).collect();
        }
        all.extend(rays.into_iter().filter(Ray::is_live));
    }
    if sorted {
        all.sort_by_cached_key(|ray| morton_code(ray, bvh.bounds));
    }
    all
}

/// Bits of a coordinate in a ray's Morton code: six of them fill 60 of 64.
const MORTON_BITS: u32 = 10;

/// Morton code of a ray: its origin in the scene's box and its direction, as six interleaved coordinates.
fn morton_code(ray: &Ray, (low, high): (Vec3, Vec3)) -> u64 {
    let place = (Vec3::from(ray.origin) - low) / (high - low).max(Vec3::splat(f32::MIN_POSITIVE));
    let direction = (Vec3::from(ray.direction) + 1.0) / 2.0;
    let cells = f32::from(1u16 << MORTON_BITS);
    let coordinates = [place.x, place.y, place.z, direction.x, direction.y, direction.z]
        .map(|c| (c * cells).clamp(0.0, cells - 1.0) as u64);
    (0..MORTON_BITS).rev().fold(0, |code, bit| coordinates.iter().fold(code, |code, c| code << 1 | c >> bit & 1))
}

/// Live rays of `kind` in tile order, made by the kernels.
///
/// # Errors
/// [`crate::Error::Device`] if the device fails.
pub fn gpu_rays(
    gpu: &Gpu,
    tracer: &Tracer,
    (bvh, tables): (&Bvh, &Tables),
    frame: &Frame,
    kind: RayKind,
) -> Result<Vec<Ray>> {
    let scene = GpuScene::upload(gpu, bvh, tracer.geometry(), tables, *frame)?;
    let buffer = |label: &str, bytes: usize| gpu.buffer(label, bytes as u64 * u64::from(CHUNK), Place::Device);
    let rays = buffer("rays", size_of::<Ray>())?;
    let hits = buffer("hits", size_of::<Hit>())?;
    let paths = buffer("paths", size_of::<Path>())?;
    let tiles = gpu.upload("tiles", &all_tiles(frame))?;
    let secondary = buffer("secondary rays", size_of::<Ray>())?;
    // Secondary rays depend on the geometry alone, whatever the materials.
    let spec = [&exactness(gpu.probe())[..], &[(SPEC_NORMALS, 0), (SPEC_TEXTURES, 0)]].concat();
    let generate = gpu.pipeline(Kernel::Generate, &spec)?;
    let reflect = gpu.pipeline(Kernel::Secondary, &spec)?;
    let mut reached: Vec<_> = scene.reached.iter().collect();
    reached.push(&tracer.geometry().tree);
    let mut stream = Stream::new(gpu);
    let mut all = Vec::new();
    for push in chunks(pixels(frame), kind) {
        stream.dispatch("generate", &generate, (&[&scene.frame, &rays, &paths, &tiles], &[]), &push, push.count)?;
        let mut made = &rays;
        if kind != RayKind::Primary {
            tracer.trace(&mut stream, "trace closest", Query::Closest, &RayBuffers::new(&rays, &hits), push.count)?;
            let buffers = [&scene.frame, &scene.materials, &scene.textures, &rays, &hits, &secondary];
            stream.dispatch("secondary", &reflect, (&buffers, &reached), &push, push.count)?;
            made = &secondary;
        }
        stream.finish()?;
        all.extend(gpu.download::<Ray>(made, 0..push.count as usize)?.into_iter().filter(Ray::is_live));
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::Quality;
    use crate::render::settings::Settings;
    use crate::scene::{procedural, select_camera};

    #[test]
    fn parts_make_up_the_picture() {
        let scene = procedural::build("room", 2000, 1).unwrap();
        let bvh = Bvh::build(&scene.positions, Quality::default()).unwrap();
        let frame =
            Settings { width: 70, height: 48, ..Settings::default() }.frame(&select_camera(&scene, None).unwrap());
        let batch = Batch { kind: RayKind::Ao, per_hit: 3, sorted: false };
        let rays = |part: &str| twin_part(&bvh, &Tables::new(&scene), &frame, batch, part.parse().unwrap());
        let parts: Vec<Ray> = (1..=7).flat_map(|k| rays(&format!("{k}/7"))).collect();
        assert_eq!(parts, rays("1/1"));
        assert!(rays("1/7").len() < parts.len() / 3);
        for bad in ["0/7", "8/7", "1/0", "1", "a/b", "-1/2"] {
            assert!(bad.parse::<Part>().is_err(), "{bad}");
        }
    }

    #[test]
    fn batches_have_as_many_rays_a_hit_as_asked_and_sorting_brings_neighbours_together() {
        let scene = procedural::build("room", 2000, 1).unwrap();
        let bvh = Bvh::build(&scene.positions, Quality::default()).unwrap();
        let frame =
            Settings { width: 64, height: 48, ..Settings::default() }.frame(&select_camera(&scene, None).unwrap());
        let batch = |per_hit, sorted| {
            let batch = Batch { kind: RayKind::Diffuse, per_hit, sorted };
            twin_batch(&bvh, &Tables::new(&scene), &frame, batch)
        };
        let one = batch(1, false);
        assert_eq!(one, twin_rays(&bvh, &Tables::new(&scene), &frame, RayKind::Diffuse));
        let four = batch(4, false);
        assert_eq!(four.len(), 4 * one.len());
        assert!(
            four.chunks(4).zip(&one).all(|(rays, first)| rays[0] == *first && rays[1].direction != first.direction)
        );
        let sorted = batch(4, true);
        let turn = |rays: &[Ray]| -> f32 {
            rays.windows(2).map(|two| Vec3::from(two[0].direction).distance(two[1].direction.into())).sum()
        };
        assert_eq!(sorted.len(), four.len());
        assert!(turn(&sorted) < 0.5 * turn(&four), "{} {}", turn(&sorted), turn(&four));
    }
}
