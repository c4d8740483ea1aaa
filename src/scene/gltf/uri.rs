//! URIs of buffers and images to bytes: data URIs, and files inside the scene's folder.

use std::collections::HashMap;
use std::path::{Component, Path, PathBuf};
use std::rc::Rc;

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use super::source::Source;
use crate::{Error, Result};

/// A file is read whole; 4 GiB is what a GLB can hold.
const MAX_FILE_BYTES: u64 = 1 << 32;

/// Reads what URIs name. A file that several objects share is read once.
pub(super) struct Reader<'a> {
    source: Source<'a>,
    files: HashMap<PathBuf, Rc<Vec<u8>>>,
}

impl<'a> Reader<'a> {
    pub fn new(source: Source<'a>) -> Self {
        Reader { source, files: HashMap::new() }
    }

    /// The bytes behind `uri`, which belongs to `object`.
    pub fn read(&mut self, object: &str, uri: &str) -> Result<Rc<Vec<u8>>> {
        if let Some(data) = uri.strip_prefix("data:") {
            return decode_data(&self.source, object, data).map(Rc::new);
        }
        let path = resolve(&self.source, object, uri)?;
        if let Some(bytes) = self.files.get(&path) {
            return Ok(bytes.clone());
        }
        let bytes = Rc::new(read_file(&path)?);
        self.files.insert(path, bytes.clone());
        Ok(bytes)
    }
}

/// Reads a regular file of bounded size; devices and pipes could be endless.
pub(super) fn read_file(path: &Path) -> Result<Vec<u8>> {
    let metadata = std::fs::metadata(path).map_err(Error::io("read", path))?;
    if !metadata.is_file() {
        return Err(Error::input(path, "file", "is not a regular file", "name a .glb or .gltf file"));
    }
    if metadata.len() > MAX_FILE_BYTES {
        let problem = format!("has {} bytes, more than {MAX_FILE_BYTES}", metadata.len());
        return Err(Error::input(path, "file", problem, "split or simplify the scene"));
    }
    std::fs::read(path).map_err(Error::io("read", path))
}

/// `[<mediatype>][;base64],<data>` (RFC 2397); glTF 2.0, section 3.6.1.1 has base64 only.
fn decode_data(source: &Source, object: &str, data: &str) -> Result<Vec<u8>> {
    let engine = GeneralPurpose::new(
        &STANDARD,
        GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
    );
    let remedy = "embed the bytes as data:application/octet-stream;base64,...";
    let Some((head, payload)) = data.split_once(',') else {
        return Err(source.fault(object, "its data URI has no comma", remedy));
    };
    if !head.ends_with(";base64") {
        return Err(source.fault(object, "its data URI is not base64", remedy));
    }
    engine.decode(payload).map_err(|e| source.fault(object, format!("its data URI does not decode: {e}"), remedy))
}

/// The real path of a relative URI; it must lie in the scene's folder, symbolic links resolved.
fn resolve(source: &Source, object: &str, uri: &str) -> Result<PathBuf> {
    let refuse = |problem: String| {
        source.fault(object, problem, "put the file beside the scene and name it by a relative path, or embed it")
    };
    let Some(folder) = source.folder else {
        return Err(refuse(format!("refers to the file {uri:?}, but an embedded scene has no folder")));
    };
    if has_scheme(uri) {
        return Err(refuse(format!("its URI {uri:?} is not a relative path")));
    }
    let decoded = percent_encoding::percent_decode_str(uri)
        .decode_utf8()
        .map_err(|_| refuse(format!("its URI {uri:?} does not decode to UTF-8")))?;
    let relative = Path::new(decoded.as_ref());
    if decoded.is_empty() || decoded.contains('\0') {
        return Err(refuse(format!("its URI {uri:?} names no file")));
    }
    if relative.components().any(|part| matches!(part, Component::Prefix(_) | Component::RootDir)) {
        return Err(refuse(format!("its URI {uri:?} is an absolute path")));
    }
    if leaves_folder(relative) {
        return Err(refuse(format!("its URI {uri:?} leaves the scene's folder")));
    }
    let missing = |error: std::io::Error| refuse(format!("the file {:?} cannot be read ({error})", decoded.as_ref()));
    let real_folder = folder.canonicalize().map_err(missing)?;
    let real = real_folder.join(relative).canonicalize().map_err(missing)?;
    if !real.starts_with(&real_folder) {
        return Err(refuse(format!("its URI {uri:?} is a link that leaves the scene's folder")));
    }
    if !real.is_file() {
        return Err(refuse(format!("{:?} is not a file", decoded.as_ref())));
    }
    Ok(real)
}

/// `scheme:` as RFC 3986, section 3.1 has it.
fn has_scheme(uri: &str) -> bool {
    uri.split_once(':').is_some_and(|(scheme, _)| {
        scheme.starts_with(|c: char| c.is_ascii_alphabetic())
            && scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
    })
}

/// Does the path step above where it starts at any point?
fn leaves_folder(path: &Path) -> bool {
    let mut depth = 0i64;
    path.components().any(|part| {
        match part {
            Component::ParentDir => depth -= 1,
            Component::Normal(_) => depth += 1,
            _ => {}
        }
        depth < 0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn schemes_are_told_from_names_with_colons() {
        assert!(has_scheme("http://a/b.bin") && has_scheme("file:///etc/passwd") && has_scheme("C:/a.bin"));
        assert!(!has_scheme("a b:c.bin") && !has_scheme("folder/a.bin") && !has_scheme(":a"));
    }

    #[test]
    fn paths_may_go_up_only_inside_the_folder() {
        assert!(!leaves_folder(Path::new("a/../b.bin")));
        assert!(leaves_folder(Path::new("a/../../b.bin")) && leaves_folder(Path::new("../b.bin")));
    }
}
