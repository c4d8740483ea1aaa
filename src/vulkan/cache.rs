//! The driver's pipeline cache, kept on disk so that only the first run compiles.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::{env, fs, io};

use ash::vk;
use xxhash_rust::xxh3::xxh3_64;

use super::context::Context;
use super::error::failed;
use crate::Result;

/// No cache of this program's few kernels comes near; a larger file is not ours.
const MAX_FILE_BYTES: u64 = 256 << 20;

/// A pipeline cache that is written back when dropped, if it has changed.
pub(super) struct DiskCache {
    context: Arc<Context>,
    raw: vk::PipelineCache,
    path: Option<PathBuf>,
    loaded: u64,
}

impl DiskCache {
    /// The cache of this device, from disk where there is one; empty otherwise.
    pub fn load(context: &Arc<Context>) -> Result<Self> {
        // Some drivers keep their UUID across versions: the version is part of the name.
        let version = xxh3_64(context.info.driver_version.as_bytes());
        let path = folder().map(|folder| folder.join(format!("pipelines-{}-{version:016x}.bin", context.info.uuid)));
        let data = path.as_deref().and_then(read).unwrap_or_default();
        let info = vk::PipelineCacheCreateInfo::default().initial_data(&data);
        // SAFETY: the device is alive. The data is what this driver build gave (path and digest); the
        // driver checks its own header beside.
        let raw = unsafe { context.device.create_pipeline_cache(&info, None) }
            .map_err(failed("open device", "vkCreatePipelineCache"))?;
        Ok(Self { context: context.clone(), raw, path, loaded: xxh3_64(&data) })
    }

    pub fn raw(&self) -> vk::PipelineCache {
        self.raw
    }
}

impl Drop for DiskCache {
    fn drop(&mut self) {
        // SAFETY: the cache was made from this device and nobody else holds it.
        let data = unsafe {
            let data = self.context.device.get_pipeline_cache_data(self.raw);
            self.context.device.destroy_pipeline_cache(self.raw, None);
            data
        };
        if let (Some(path), Ok(data)) = (&self.path, data)
            && xxh3_64(&data) != self.loaded
            && let Err(error) = write(path, &data)
        {
            tracing::debug!("pipeline cache not written to {}: {error}", path.display());
        }
    }
}

/// `$XDG_CACHE_HOME/caribou`, else `~/.cache/caribou` (XDG Base Directory Specification).
fn folder() -> Option<PathBuf> {
    let absolute = |name| env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let base = absolute("XDG_CACHE_HOME").or_else(|| absolute("HOME").map(|home| home.join(".cache")))?;
    Some(base.join("caribou"))
}

/// The file's data, if it is whole: a driver must not see what a torn write or a bad disk left.
fn read(path: &Path) -> Option<Vec<u8>> {
    if fs::metadata(path).ok()?.len() > MAX_FILE_BYTES {
        return None;
    }
    let mut data = fs::read(path).ok()?;
    let digest = data.split_off(data.len().checked_sub(8)?);
    (digest == xxh3_64(&data).to_le_bytes()).then_some(data)
}

/// Data, then its digest; the file appears whole or not at all.
fn write(path: &Path, data: &[u8]) -> io::Result<()> {
    use io::Write;
    let folder = path.parent().ok_or(io::ErrorKind::InvalidInput)?;
    fs::create_dir_all(folder)?;
    let mut file = tempfile::NamedTempFile::new_in(folder)?;
    file.write_all(data)?;
    file.write_all(&xxh3_64(data).to_le_bytes())?;
    file.persist(path)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_whole_files_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new").join("cache.bin");
        assert_eq!(read(&path), None);
        write(&path, b"data").unwrap();
        assert_eq!(read(&path).as_deref(), Some(&b"data"[..]));
        let whole = fs::read(&path).unwrap();
        for length in 0..whole.len() {
            fs::write(&path, &whole[..length]).unwrap();
            assert_eq!(read(&path), None, "cut to {length} bytes");
        }
        let mut damaged = whole;
        damaged[1] ^= 1;
        fs::write(&path, &damaged).unwrap();
        assert_eq!(read(&path), None);
    }
}
