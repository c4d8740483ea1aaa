//! Files that appear whole or not at all: written beside the target, synced, renamed over it.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::{Error, Result};

/// Says at once, before any work starts, whether [`write_atomically`] could write `path`: the folder
/// exists and takes new files, and the target is absent or a regular file that may be replaced.
/// Creates nothing that stays.
///
/// # Errors
/// [`Error::Usage`] or [`Error::Io`], both exit code 2.
pub fn check_writable(path: &Path) -> Result<()> {
    let target = replaceable(path)?;
    temporary_beside(&target).map(drop).map_err(Error::io("create", path))
}

/// Calls `write` with a temporary file in the folder of `path`; if it returns `Ok`, syncs that file
/// and renames it to `path`. On any error the temporary file is removed and `path` is as it was.
///
/// A new file gets mode 0666 less the umask, like any program's; a replaced one keeps its mode. A
/// symbolic link stays and the file that it points to is replaced.
///
/// # Errors
/// Whatever `write` returns; [`Error::Usage`] or [`Error::Io`] if `path` cannot be written.
pub fn write_atomically<T>(path: &Path, write: impl FnOnce(&mut BufWriter<&File>) -> Result<T>) -> Result<T> {
    let target = replaceable(path)?;
    let temporary = temporary_beside(&target).map_err(Error::io("create", path))?;
    let mut writer = BufWriter::new(temporary.as_file());
    let value = write(&mut writer)?;
    writer.flush().map_err(Error::io("write", path))?;
    drop(writer);
    if let Ok(replaced) = fs::metadata(&target) {
        temporary.as_file().set_permissions(replaced.permissions()).map_err(Error::io("write", path))?;
    }
    temporary.as_file().sync_all().map_err(Error::io("write", path))?;
    temporary.persist(&target).map_err(|e| e.error).map_err(Error::io("rename", path))?;
    Ok(value)
}

/// The file that a write to `path` replaces, links resolved. Renaming over a folder fails late, and over
/// a device such as /dev/null it succeeds, which is worse; so both are refused here.
fn replaceable(path: &Path) -> Result<PathBuf> {
    if path.file_name().is_none() {
        return Err(Error::usage(format!("'{}' names no file", path.display()), "give a file name to write to"));
    }
    let metadata = match fs::metadata(path) {
        Ok(metadata) => metadata,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(path.to_path_buf()),
        Err(error) => return Err(Error::io("write", path)(error)),
    };
    if !metadata.is_file() {
        let what = if metadata.is_dir() { "a folder" } else { "not a regular file" };
        return Err(Error::usage(format!("'{}' is {what}", path.display()), "give a file name to write to"));
    }
    if metadata.permissions().readonly() {
        let what = format!("'{}' exists and is write-protected", path.display());
        return Err(Error::usage(what, "choose another name or lift the protection"));
    }
    path.canonicalize().map_err(Error::io("write", path))
}

/// An empty file in the folder of `target`, removed when dropped.
fn temporary_beside(target: &Path) -> io::Result<NamedTempFile> {
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".caribou-").suffix(".tmp");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names_in(folder: &Path) -> Vec<String> {
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn the_file_appears_whole_and_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        check_writable(&path).unwrap();
        assert!(names_in(folder.path()).is_empty());
        let value = write_atomically(&path, |w| {
            assert!(!path.exists());
            w.write_all(b"new").map_err(Error::io("write", &path))?;
            Ok(7)
        });
        assert_eq!(value.unwrap(), 7);
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(names_in(folder.path()), ["a.txt"]);
    }

    #[test]
    fn an_error_midway_leaves_the_target_untouched_and_no_litter() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        fs::write(&path, "old").unwrap();
        let result: Result<()> = write_atomically(&path, |w| {
            w.write_all(&[b'x'; 100_000]).map_err(Error::io("write", &path))?;
            Err(Error::Check("planted".into()))
        });
        assert!(matches!(result, Err(Error::Check(_))));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names_in(folder.path()), ["a.txt"]);
    }

    #[test]
    fn a_relative_name_without_a_folder_is_written_to_the_current_one() {
        check_writable(Path::new("no-such-file.exr")).unwrap();
        assert!(!Path::new("no-such-file.exr").exists());
    }

    #[test]
    fn targets_that_cannot_be_files_are_refused_before_work() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "").unwrap();
        for bad in [
            folder.path().to_path_buf(),
            folder.path().join("missing/a.exr"),
            file.join("a.exr"),
            folder.path().join(".."),
            PathBuf::new(),
        ] {
            let error = check_writable(&bad).expect_err(&bad.display().to_string());
            assert_eq!(error.exit_code(), 2, "{error}");
            let written = write_atomically(&bad, |_| Ok(()));
            assert!(written.is_err(), "{}", bad.display());
        }
        assert_eq!(names_in(folder.path()), ["file"]);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_read_only_folder_and_a_device_are_refused_even_to_root() {
        assert!(matches!(check_writable(Path::new("/proc/a.exr")), Err(Error::Io { action: "create", .. })));
        assert!(matches!(check_writable(Path::new("/dev/null")), Err(Error::Usage { .. })));
    }

    #[cfg(unix)]
    #[test]
    fn modes_are_those_of_an_ordinary_file() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
        let ordinary = folder.path().join("ordinary");
        File::create(&ordinary).unwrap();
        let new = folder.path().join("new");
        write_atomically(&new, |_| Ok(())).unwrap();
        assert_eq!(mode(&new), mode(&ordinary));

        fs::set_permissions(&new, fs::Permissions::from_mode(0o640)).unwrap();
        write_atomically(&new, |_| Ok(())).unwrap();
        assert_eq!(mode(&new), 0o640);

        fs::set_permissions(&new, fs::Permissions::from_mode(0o444)).unwrap();
        assert!(matches!(check_writable(&new), Err(Error::Usage { .. })));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link() {
        let folder = tempfile::tempdir().unwrap();
        let (real, link) = (folder.path().join("real"), folder.path().join("link"));
        fs::write(&real, "old").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        write_atomically(&link, |w| w.write_all(b"new").map_err(Error::io("write", &link))).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&real).unwrap(), b"new");
    }
}
