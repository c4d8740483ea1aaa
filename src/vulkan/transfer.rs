//! Host to device and back: directly where the host sees the memory, elsewhere through a staging
//! buffer.

use std::ops::Range;
use std::ptr::NonNull;

use bytemuck::Pod;

use super::buffer::{Buffer, Memory, Place};
use super::gpu::Gpu;
use crate::{Error, Result};

/// Largest staging buffer; more is copied in pieces.
const STAGING_BYTES: usize = 64 << 20;

impl Gpu {
    /// A device buffer that holds `data`.
    ///
    /// # Errors
    /// As [`Gpu::buffer`] and [`super::Recorder::submit`].
    pub fn upload<T: Pod>(&self, label: &str, data: &[T]) -> Result<Buffer> {
        let buffer = self.buffer(label, size_of_val(data) as u64, Place::Device)?;
        self.write(&buffer, 0, data)?;
        Ok(buffer)
    }

    /// Writes `data` over the elements of `buffer` from `first` on.
    ///
    /// # Errors
    /// [`Error::Check`] when it does not fit; [`Error::Device`] when the device fails.
    pub fn write<T: Pod>(&self, buffer: &Buffer, first: usize, data: &[T]) -> Result<()> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let offset = byte_range::<T>(buffer, &(first..first.saturating_add(data.len())))?.start;
        match buffer.0.mapped() {
            Some(_) => self.write_mapped(&buffer.0, offset, bytes),
            None => self.write_staged(buffer, offset, bytes),
        }
    }

    /// The elements `range` of `buffer`.
    ///
    /// # Errors
    /// [`Error::Check`] when the buffer is shorter; [`Error::Device`] when the device fails.
    pub fn download<T: Pod>(&self, buffer: &Buffer, range: Range<usize>) -> Result<Vec<T>> {
        let offset = byte_range::<T>(buffer, &range)?.start;
        let mut data = vec![T::zeroed(); range.len()];
        let bytes = bytemuck::cast_slice_mut(&mut data);
        match buffer.0.mapped().filter(|_| buffer.0.reads_fast()) {
            Some(_) => self.read_mapped(&buffer.0, offset, bytes)?,
            None => self.read_staged(buffer, offset, bytes)?,
        }
        Ok(data)
    }

    fn write_staged(&self, buffer: &Buffer, mut offset: u64, bytes: &[u8]) -> Result<()> {
        let staging = self.staging(bytes.len(), Place::Upload)?;
        for piece in bytes.chunks(STAGING_BYTES) {
            self.write_mapped(&staging.0, 0, piece)?;
            let mut recorder = self.recorder(&format!("upload {}", buffer.label()))?;
            recorder.copy(&staging, 0, buffer, offset, piece.len() as u64)?;
            recorder.submit()?;
            offset += piece.len() as u64;
        }
        Ok(())
    }

    fn read_staged(&self, buffer: &Buffer, mut offset: u64, bytes: &mut [u8]) -> Result<()> {
        let staging = self.staging(bytes.len(), Place::Readback)?;
        for piece in bytes.chunks_mut(STAGING_BYTES) {
            let mut recorder = self.recorder(&format!("download {}", buffer.label()))?;
            recorder.copy(buffer, offset, &staging, 0, piece.len() as u64)?;
            recorder.submit()?;
            self.read_mapped(&staging.0, 0, piece)?;
            offset += piece.len() as u64;
        }
        Ok(())
    }

    fn staging(&self, bytes: usize, place: Place) -> Result<Buffer> {
        self.buffer("staging", bytes.min(STAGING_BYTES) as u64, place)
    }

    fn write_mapped(&self, memory: &Memory, offset: u64, bytes: &[u8]) -> Result<()> {
        let target = host_range(memory, offset, bytes.len())?;
        let _device_idle = self.context.queue();
        // SAFETY: the range is mapped and within the buffer (`host_range`); neither the device nor
        // another thread touches it while the queue is held.
        unsafe { target.copy_from_nonoverlapping(NonNull::from(bytes).cast(), bytes.len()) };
        Ok(())
    }

    fn read_mapped(&self, memory: &Memory, offset: u64, bytes: &mut [u8]) -> Result<()> {
        let source = host_range(memory, offset, bytes.len())?;
        let _device_idle = self.context.queue();
        // SAFETY: as in `write_mapped`.
        unsafe { source.copy_to_nonoverlapping(NonNull::from(&mut *bytes).cast(), bytes.len()) };
        Ok(())
    }
}

/// The bytes of the elements `range`, if they lie within the buffer.
fn byte_range<T>(buffer: &Buffer, range: &Range<usize>) -> Result<Range<u64>> {
    let bytes = |elements: usize| (elements as u64).checked_mul(size_of::<T>() as u64);
    match (bytes(range.start), bytes(range.end)) {
        (Some(start), Some(end)) if start <= end && end <= buffer.bytes() => Ok(start..end),
        _ => Err(Error::Check(format!(
            "elements {range:?} of {} bytes each are outside the buffer {} ({} bytes)",
            size_of::<T>(),
            buffer.label(),
            buffer.bytes()
        ))),
    }
}

/// Where the host sees `bytes` bytes of the buffer from `offset` on.
fn host_range(memory: &Memory, offset: u64, bytes: usize) -> Result<NonNull<u8>> {
    let mapped = memory.mapped().filter(|_| offset.checked_add(bytes as u64).is_some_and(|end| end <= memory.bytes));
    let Some(mapped) = mapped else {
        return Err(Error::Check(format!("the host does not see {bytes} bytes at {offset} of {}", memory.label)));
    };
    // SAFETY: the offset is within the mapping.
    Ok(unsafe { mapped.add(offset as usize) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vulkan::gpu;

    /// Software drivers show all memory to the host, so the staged way has to be asked for.
    #[test]
    fn staged_pieces_come_back() -> Result<()> {
        let Some(gpu) = gpu::for_test(false) else { return Ok(()) };
        let bytes: Vec<u8> =
            (0..2 * STAGING_BYTES as u32 + 12_345).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let buffer = gpu.buffer("pieces", bytes.len() as u64 + 7, Place::Device)?;
        gpu.write_staged(&buffer, 5, &bytes)?;
        let mut back = vec![0; bytes.len()];
        gpu.read_staged(&buffer, 5, &mut back)?;
        assert!(back == bytes);
        gpu.read_staged(&buffer, 5, &mut [])?;
        Ok(())
    }
}
