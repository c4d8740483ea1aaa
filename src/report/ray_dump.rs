//! Triangles, rays and hits in one binary file, for comparison with other ray tracers.
//!
//! Little-endian throughout:
//!
//! | bytes | content |
//! |---|---|
//! | 20 | magic `CRBR`, then u32 version 2, ray count, triangle count, query (0: the nearest hit, 1: any) |
//! | 36 a triangle | nine f32: three corners, in order of primitive id |
//! | 32 a ray | eight f32: origin, t_min, direction, t_max |
//! | 16 a ray | its hit: f32 t, u32 primitive id (all ones: miss), f32 u, f32 v; of any hit only whether it is one counts |
//!
//! `tools/compare_embree.py` reads it.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use glam::Vec3;

use crate::atomic_file::write_atomically;
use crate::trace::{Hit, Query, Ray};
use crate::{Error, Result};

const MAGIC: [u8; 4] = *b"CRBR";
const VERSION: u32 = 2;

/// Writes a dump to `path`, whole or not at all.
///
/// # Errors
/// [`Error::Check`] if there is not one hit a ray or a count exceeds u32; [`Error::Io`] or
/// [`Error::Usage`] if `path` cannot be written.
pub fn write(path: &Path, triangles: &[[Vec3; 3]], query: Query, rays: &[Ray], hits: &[Hit]) -> Result<()> {
    if rays.len() != hits.len() {
        return Err(Error::Check(format!("{} hits for {} rays", hits.len(), rays.len())));
    }
    let count = |count: usize| {
        u32::try_from(count).map_err(|_| Error::Check(format!("{count} elements are too many for a ray dump")))
    };
    let header = [VERSION, count(rays.len())?, count(triangles.len())?, u32::from(query == Query::Any)];
    write_atomically(path, |writer| write_body(writer, header, triangles, rays, hits).map_err(Error::io("write", path)))
}

fn write_body(
    writer: &mut BufWriter<&File>,
    header: [u32; 4],
    triangles: &[[Vec3; 3]],
    rays: &[Ray],
    hits: &[Hit],
) -> std::io::Result<()> {
    writer.write_all(&MAGIC)?;
    for word in header {
        writer.write_all(&word.to_le_bytes())?;
    }
    for corner in triangles.as_flattened() {
        write_floats(writer, corner.to_array())?;
    }
    for ray in rays {
        write_floats(writer, ray.origin)?;
        write_floats(writer, [ray.t_min])?;
        write_floats(writer, ray.direction)?;
        write_floats(writer, [ray.t_max])?;
    }
    for hit in hits {
        write_floats(writer, [hit.t])?;
        writer.write_all(&hit.prim.to_le_bytes())?;
        write_floats(writer, [hit.u, hit.v])?;
    }
    Ok(())
}

fn write_floats<const N: usize>(writer: &mut BufWriter<&File>, values: [f32; N]) -> std::io::Result<()> {
    values.iter().try_for_each(|value| writer.write_all(&value.to_le_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared::NO_HIT;

    fn ray(first: f32) -> Ray {
        let [a, b, c, d, e, f, g, h] = std::array::from_fn(|i| first + i as f32);
        Ray { origin: [a, b, c], t_min: d, direction: [e, f, g], t_max: h }
    }

    #[test]
    fn every_word_stands_where_the_format_says() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.rays");
        let triangles = [[Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0), Vec3::new(7.0, 8.0, 9.0)]];
        let rays = [ray(10.0), ray(20.0)];
        let hits = [Hit { t: 30.0, prim: 0, u: 31.0, v: 32.0 }, Hit { t: 27.0, prim: NO_HIT, u: 0.0, v: 0.0 }];
        write(&path, &triangles, Query::Any, &rays, &hits).unwrap();

        let bytes = std::fs::read(&path).unwrap();
        assert_eq!(&bytes[..4], b"CRBR");
        let words: Vec<u32> = bytes[4..].chunks(4).map(|w| u32::from_le_bytes(w.try_into().unwrap())).collect();
        let floats =
            |range: std::ops::Range<usize>| -> Vec<f32> { words[range].iter().map(|w| f32::from_bits(*w)).collect() };
        assert_eq!(words[..4], [2, 2, 1, 1]);
        assert_eq!(floats(4..13), (1..10).map(|i| i as f32).collect::<Vec<_>>());
        assert_eq!(floats(13..21), (10..18).map(|i| i as f32).collect::<Vec<_>>());
        assert_eq!(floats(21..29), (20..28).map(|i| i as f32).collect::<Vec<_>>());
        assert_eq!((words[29], words[30]), (30f32.to_bits(), 0));
        assert_eq!(floats(31..33), [31.0, 32.0]);
        assert_eq!((words[33], words[34], words.len()), (27f32.to_bits(), NO_HIT, 37));
    }

    #[test]
    fn a_missing_hit_is_an_error_and_no_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.rays");
        assert!(matches!(write(&path, &[], Query::Closest, &[ray(0.0)], &[]), Err(Error::Check(_))));
        assert!(!path.exists());
    }
}
