//! The rays that benchmarks trace: the same on every device and on the CPU.

use super::gpu_scene::GpuScene;
use crate::Result;
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

    fn code(self) -> u32 {
        match self {
            RayKind::Primary => KIND_PRIMARY,
            RayKind::Ao => KIND_AO,
            RayKind::Diffuse => KIND_DIFFUSE,
            RayKind::Reflect => KIND_REFLECT,
        }
    }
}

fn chunks(frame: &Frame, kind: RayKind) -> impl Iterator<Item = StagePush> {
    let total = tile_count(frame.width, frame.height).unwrap_or(0);
    (0..total).step_by(CHUNK as usize).map(move |first| StagePush {
        first,
        count: CHUNK.min(total - first),
        sample_index: 0,
        argument: kind.code(),
    })
}

/// Live rays of `kind` in tile order, made by the twins.
pub fn twin_rays(bvh: &Bvh, tables: &Tables, frame: &Frame, kind: RayKind) -> Vec<Ray> {
    let mut all = Vec::new();
    for push in chunks(frame, kind) {
        let mut rays = vec![Ray::DEAD; push.count as usize];
        let mut paths: Vec<Path> = vec![bytemuck::Zeroable::zeroed(); rays.len()];
        twin::generate::generate(frame, push, &mut rays, &mut paths);
        if kind != RayKind::Primary {
            let (hits, _) = twin::trace::trace_closest(bvh, &rays);
            let mut secondary = vec![Ray::DEAD; rays.len()];
            twin::secondary::secondary(Stage { bvh, tables, frame }, push, &rays, &hits, &mut secondary);
            rays = secondary;
        }
        all.extend(rays.into_iter().filter(Ray::is_live));
    }
    all
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
    let secondary = buffer("secondary rays", size_of::<Ray>())?;
    // Secondary rays depend on the geometry alone, whatever the materials.
    let spec = [&exactness(gpu.probe())[..], &[(SPEC_NORMALS, 0), (SPEC_TEXTURES, 0)]].concat();
    let generate = gpu.pipeline(Kernel::Generate, &spec)?;
    let reflect = gpu.pipeline(Kernel::Secondary, &spec)?;
    let mut reached: Vec<_> = scene.reached.iter().collect();
    reached.push(&tracer.geometry().triangles);
    let mut stream = Stream::new(gpu);
    let mut all = Vec::new();
    for push in chunks(frame, kind) {
        stream.dispatch("generate", &generate, (&[&scene.frame, &rays, &paths], &[]), &push, push.count)?;
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
