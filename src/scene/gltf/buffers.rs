//! The bytes of buffers, and the parts of them that buffer views name.

use std::rc::Rc;

use gltf::json::{Index, Root, buffer};

use super::source::Source;
use super::uri::Reader;
use crate::Result;

/// The bytes of one buffer.
enum Bytes<'a> {
    /// The BIN chunk of the file itself.
    Chunk(&'a [u8]),
    /// A file or data URI.
    Read(Rc<Vec<u8>>),
}

/// All buffers of a file. Every buffer view lies inside its buffer.
pub(super) struct Buffers<'a> {
    root: &'a Root,
    buffers: Vec<Bytes<'a>>,
}

impl<'a> Buffers<'a> {
    /// Reads the buffers and checks the buffer views.
    pub fn load(source: &Source, root: &'a Root, bin: Option<&'a [u8]>, reader: &mut Reader) -> Result<Self> {
        let mut buffers = Vec::new();
        for (i, buffer) in root.buffers.iter().enumerate() {
            let object = format!("buffer {i}");
            let bytes = match (&buffer.uri, bin) {
                (Some(uri), _) => Bytes::Read(reader.read(&object, uri)?),
                (None, Some(bin)) if i == 0 => Bytes::Chunk(bin),
                _ => {
                    let problem = "has no uri, and no BIN chunk stands for it";
                    return Err(source.fault(object, problem, "the data is missing: export the scene again"));
                }
            };
            let available = bytes.as_slice().len();
            if buffer.byte_length.0 > available as u64 {
                let problem = format!("byteLength is {} but there are only {available} bytes", buffer.byte_length.0);
                return Err(source.fault(object, problem, "the data is truncated: copy or export it again"));
            }
            buffers.push(bytes);
        }
        for (i, view) in root.buffer_views.iter().enumerate() {
            check_view(source, i, view, root.buffers[view.buffer.value()].byte_length.0)?;
        }
        Ok(Buffers { root, buffers })
    }

    /// The bytes of a buffer view.
    pub fn view(&self, index: Index<buffer::View>) -> &[u8] {
        let view = &self.root.buffer_views[index.value()];
        let offset = view.byte_offset.map_or(0, |o| o.0) as usize;
        &self.buffers[view.buffer.value()].as_slice()[offset..offset + view.byte_length.0 as usize]
    }
}

impl Bytes<'_> {
    fn as_slice(&self) -> &[u8] {
        match self {
            Bytes::Chunk(bytes) => bytes,
            Bytes::Read(bytes) => bytes,
        }
    }
}

fn check_view(source: &Source, i: usize, view: &buffer::View, buffer_length: u64) -> Result<()> {
    let (offset, length) = (view.byte_offset.map_or(0, |o| o.0), view.byte_length.0);
    let fault = |problem| Err(source.fault(format!("bufferView {i}"), problem, "export the scene again"));
    if offset.checked_add(length).is_none_or(|end| end > buffer_length) {
        let buffer = view.buffer.value();
        return fault(format!(
            "byteOffset {offset} plus byteLength {length} is beyond buffer {buffer} of {buffer_length} bytes"
        ));
    }
    match view.byte_stride {
        // glTF 2.0, section 5.11.4.
        Some(stride) if !(4..=252).contains(&stride.0) || stride.0 % 4 != 0 => {
            fault(format!("byteStride {} is not a multiple of 4 from 4 to 252", stride.0))
        }
        _ => Ok(()),
    }
}
