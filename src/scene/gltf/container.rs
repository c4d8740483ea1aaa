//! The two containers of glTF: bare JSON text, and GLB with a JSON chunk and an optional BIN chunk
//! (glTF 2.0, chapter 4).

use super::source::Source;
use crate::Result;

const MAGIC: &[u8] = b"glTF";
const HEADER_BYTES: usize = 12;
const CHUNK_HEADER_BYTES: usize = 8;
const CHUNK_JSON: u32 = 0x4E4F_534A;
const CHUNK_BIN: u32 = 0x004E_4942;

/// The parts of a file, borrowed from its bytes.
#[derive(Debug)]
pub(super) struct Container<'a> {
    pub json: &'a [u8],
    /// The BIN chunk, which buffer 0 stands for if it has no URI.
    pub bin: Option<&'a [u8]>,
}

/// Takes a file apart. The name and the content must agree on which container it is.
pub(super) fn split<'a>(source: &Source, bytes: &'a [u8]) -> Result<Container<'a>> {
    let extension = source.file.extension().map(|e| e.to_ascii_lowercase());
    let named_as = |e: &str| extension.as_deref().is_some_and(|x| x == e);
    let is_glb = bytes.starts_with(MAGIC);
    if is_glb && named_as("gltf") {
        return Err(source.fault("header", "is a binary glTF (GLB) named .gltf", "rename it to .glb"));
    }
    if is_glb {
        return split_glb(source, bytes);
    }
    // An embedded scene has no folder and is always a GLB.
    if named_as("glb") || source.folder.is_none() {
        let start = String::from_utf8_lossy(&bytes[..bytes.len().min(4)]).into_owned();
        return Err(source.fault(
            "header",
            format!("starts with {start:?} where a GLB file has \"glTF\""),
            "check that the file is complete and is binary glTF; name JSON files .gltf",
        ));
    }
    Ok(Container { json: bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes), bin: None })
}

fn split_glb<'a>(source: &Source, bytes: &'a [u8]) -> Result<Container<'a>> {
    let truncated = |object: &str, have: usize, need: usize| {
        source.fault(
            object.to_string(),
            format!("needs {need} bytes but only {have} are there"),
            "the file is truncated or damaged: copy or export it again",
        )
    };
    if bytes.len() < HEADER_BYTES {
        return Err(truncated("header", bytes.len(), HEADER_BYTES));
    }
    let version = u32_at(bytes, 4);
    if version != 2 {
        let remedy = "export the scene as glTF 2.0";
        return Err(source.fault("header", format!("is GLB version {version}, supported is 2"), remedy));
    }
    let length = u32_at(bytes, 8) as usize;
    if length != bytes.len() {
        return Err(source.fault(
            "header",
            format!("states a length of {length} bytes but the file has {}", bytes.len()),
            "the file is truncated or damaged: copy or export it again",
        ));
    }

    let mut rest = &bytes[HEADER_BYTES..];
    let mut chunks = Vec::new();
    // Only the first two chunks have a meaning; what follows must be ignored (glTF 2.0, section 4.4.3).
    while !rest.is_empty() && chunks.len() < 2 {
        let object = format!("chunk {}", chunks.len());
        if rest.len() < CHUNK_HEADER_BYTES {
            return Err(truncated(&object, rest.len(), CHUNK_HEADER_BYTES));
        }
        let (size, kind) = (u32_at(rest, 0) as usize, u32_at(rest, 4));
        rest = &rest[CHUNK_HEADER_BYTES..];
        if size > rest.len() {
            return Err(truncated(&object, rest.len(), size));
        }
        let (data, after) = rest.split_at(size);
        chunks.push((kind, data));
        rest = after;
    }
    match chunks[..] {
        [(CHUNK_JSON, json), (CHUNK_BIN, bin)] => Ok(Container { json, bin: Some(bin) }),
        [(CHUNK_JSON, json), ..] => Ok(Container { json, bin: None }),
        _ => Err(source.fault("chunk 0", "is not the JSON chunk", "a GLB file must begin with it: export it again")),
    }
}

/// Little-endian word at `offset`, which the caller has checked.
fn u32_at(bytes: &[u8], offset: usize) -> u32 {
    u32::from_le_bytes([bytes[offset], bytes[offset + 1], bytes[offset + 2], bytes[offset + 3]])
}
