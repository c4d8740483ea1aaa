//! Step traces of some rays of a batch, recorded by the kernels or the twin, and their files.
//!
//! A file is little endian: the 8 bytes `CBSTEPS1`; as u64 the number of rays R and of steps S; R times u64,
//! the index of each ray in its batch; R + 1 times u64, where the steps of each ray begin, and S; S times u32,
//! the steps.

use std::io::Write;
use std::path::Path;

use super::options::Query;
use super::steps::{StepTrace, steps_of};
use super::stream::Stream;
use super::tracer::{RayBuffers, StepBuffers, Tracer};
use crate::atomic_file::write_atomically;
use crate::layout::{Hit, Ray, RayCounters};
use crate::twin::traverse::Tree;
use crate::vulkan::{Gpu, Place};
use crate::{Error, Result};

const MAGIC: &[u8; 8] = b"CBSTEPS1";

/// Step traces of some rays of a batch.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StepSample {
    /// Index of each recorded ray in its batch.
    pub rays: Vec<u64>,
    /// The steps of the k-th of them.
    pub trace: StepTrace,
}

/// `count` of `rays` rays at even distances; all if there are no more.
pub fn sample(rays: u64, count: u64) -> Vec<u64> {
    if count >= rays { (0..rays).collect() } else { (0..count).map(|k| k * rays / count).collect() }
}

impl StepSample {
    /// Records the rays `which` of a batch on the twin.
    pub fn by_twin(tree: &impl Tree, query: Query, rays: &[Ray], which: Vec<u64>) -> StepSample {
        let chosen: Vec<Ray> = which.iter().map(|&ray| rays[ray as usize]).collect();
        StepSample { rays: which, trace: steps_of(tree, &chosen, query) }
    }

    /// Records the rays `which` of a batch by the kernels of `tracer`: traced once to count steps, and once
    /// more to write them.
    ///
    /// # Errors
    /// As [`Tracer::trace`]; [`Error::Device`] if memory for the steps is short.
    pub fn by_kernels(gpu: &Gpu, tracer: &Tracer, query: Query, rays: &[Ray], which: Vec<u64>) -> Result<StepSample> {
        let count = rays.len();
        let ray_buffer = gpu.upload("rays", rays)?;
        let hits = gpu.buffer("hits", (count * size_of::<Hit>()) as u64, Place::Device)?;
        let counters = gpu.buffer("counters", (count * size_of::<RayCounters>()) as u64, Place::Device)?;
        let buffers = RayBuffers::new(&ray_buffer, &hits).counted(&counters);
        let mut stream = Stream::new(gpu);
        tracer.trace(&mut stream, "count steps", query, &buffers, count as u32)?;
        stream.finish()?;
        let counted = gpu.download::<RayCounters>(&counters, 0..count)?;
        let length = |&ray: &u64| u64::from(counted[ray as usize].node_visits + counted[ray as usize].leaf_visits);
        let starts = starts_of(which.iter().map(length));
        let words = starts[which.len()] as usize;
        let word_buffer = gpu.buffer("steps", words as u64 * 4, Place::Device)?;
        let mut addresses = vec![0u64; count];
        for (&ray, start) in which.iter().zip(&starts) {
            addresses[ray as usize] = word_buffer.address() + 4 * start;
        }
        let steps = StepBuffers { starts: gpu.upload("starts of steps", &addresses)?, words: word_buffer };
        tracer.trace(
            &mut stream,
            "record steps",
            query,
            &RayBuffers { steps: Some(&steps), ..buffers },
            count as u32,
        )?;
        stream.finish()?;
        let steps = gpu.download::<u32>(&steps.words, 0..words)?;
        Ok(StepSample { rays: which, trace: StepTrace { starts, steps } })
    }

    /// Adds the rays of a further batch, whose first ray has index `first`.
    pub fn append(&mut self, first: u64, more: &StepSample) {
        let base = self.trace.steps.len() as u64;
        self.trace.starts.truncate(self.rays.len());
        self.trace.starts.extend(more.trace.starts.iter().map(|start| base + start));
        self.trace.steps.extend(&more.trace.steps);
        self.rays.extend(more.rays.iter().map(|ray| first + ray));
    }

    /// Writes a file.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be written; then there is no file.
    pub fn write(&self, path: &Path) -> Result<()> {
        let StepTrace { starts, steps } = &self.trace;
        let counts = [self.rays.len() as u64, steps.len() as u64];
        let longs = counts.iter().chain(&self.rays).chain(starts).flat_map(|value| value.to_le_bytes());
        let mut bytes = MAGIC.to_vec();
        bytes.extend(longs);
        bytes.extend(steps.iter().flat_map(|step| step.to_le_bytes()));
        write_atomically(path, |file| file.write_all(&bytes).map_err(Error::io("write", path)))
    }

    /// Reads a file.
    ///
    /// # Errors
    /// [`Error::Input`] naming what is wrong with it; [`Error::Io`] if it cannot be read.
    pub fn read(path: &Path) -> Result<StepSample> {
        let bytes = std::fs::read(path).map_err(Error::io("read", path))?;
        StepSample::parse(&bytes).map_err(|(object, problem)| Error::Input {
            file: path.to_owned(),
            object: object.to_owned(),
            problem,
            remedy: "record it again with caribou bench --step-trace".to_owned(),
        })
    }

    fn parse(bytes: &[u8]) -> Result<StepSample, (&'static str, String)> {
        let (magic, rest) = bytes.split_at_checked(8).ok_or(("header", "the file is too short".to_owned()))?;
        if magic != MAGIC {
            return Err(("header", "it is not a step trace of version 1".to_owned()));
        }
        let long = |k: usize| Some(u64::from_le_bytes(rest.get(8 * k..8 * k + 8)?.try_into().ok()?));
        let (rays, steps) = long(0).zip(long(1)).ok_or(("header", "the file ends in it".to_owned()))?;
        // In 128 bits no sum of counts overflows.
        let expected = 16 + 8 * (2 * u128::from(rays) + 1) + 4 * u128::from(steps);
        if expected != rest.len() as u128 {
            return Err((
                "header",
                format!("{rays} rays and {steps} steps take {expected} bytes, {} follow", rest.len()),
            ));
        }
        let rays = rays as usize;
        let longs = |from: usize, count: usize| (from..from + count).filter_map(long).collect::<Vec<u64>>();
        let starts = longs(2 + rays, rays + 1);
        if !starts.is_sorted() || starts[0] != 0 || starts[rays] != steps {
            return Err(("starts", "they do not go from 0 to the number of steps".to_owned()));
        }
        let words = rest[16 + 8 * (2 * rays + 1)..].as_chunks().0;
        let steps = words.iter().map(|&word| u32::from_le_bytes(word)).collect();
        Ok(StepSample { rays: longs(2, rays), trace: StepTrace { starts, steps } })
    }
}

/// Running sums from 0 on.
fn starts_of(lengths: impl Iterator<Item = u64>) -> Vec<u64> {
    let mut starts = vec![0];
    starts.extend(lengths.scan(0, |sum, length| {
        *sum += length;
        Some(*sum)
    }));
    starts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> StepSample {
        let trace = StepTrace { starts: vec![0, 2, 3], steps: vec![0, 0x8800_0001, 5] };
        StepSample { rays: vec![0, 7], trace }
    }

    #[test]
    fn a_file_gives_back_what_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("steps");
        example().write(&path).unwrap();
        assert_eq!(StepSample::read(&path).unwrap(), example());
        let nothing = StepTrace { starts: vec![0], steps: vec![] };
        StepSample { rays: vec![], trace: nothing }.write(&path).unwrap();
        assert_eq!(StepSample::read(&path).unwrap().rays.len(), 0);
    }

    #[test]
    fn damaged_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("steps");
        example().write(&path).unwrap();
        let good = std::fs::read(&path).unwrap();
        let mut damaged: Vec<Vec<u8>> = (0..good.len()).map(|length| good[..length].to_vec()).collect();
        for (at, byte) in [(0, b'X'), (8, 255), (15, 255), (16, 9), (23, 255), (40, 1), (48, 200)] {
            damaged.push(good.clone());
            damaged.last_mut().unwrap()[at] = byte;
        }
        for bytes in damaged {
            std::fs::write(&path, &bytes).unwrap();
            let error = StepSample::read(&path).unwrap_err();
            assert_eq!(error.exit_code(), 2, "{error}");
        }
    }

    #[test]
    fn samples_are_spread_evenly() {
        assert_eq!(sample(10, 4), [0, 2, 5, 7]);
        assert_eq!(sample(3, 3), [0, 1, 2]);
        assert_eq!(sample(3, 100), [0, 1, 2]);
        assert!(sample(0, 5).is_empty());
    }

    #[test]
    fn batches_are_appended() {
        let mut all = StepSample::default();
        all.append(0, &example());
        all.append(100, &example());
        assert_eq!((all.rays.as_slice(), all.trace.starts.as_slice()), (&[0, 7, 100, 107][..], &[0, 2, 3, 5, 6][..]));
        assert_eq!(all.trace.of(3), [5]);
    }
}
