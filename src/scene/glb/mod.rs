//! Writes a [`Scene`] as binary glTF 2.0: one mesh a material, welded and indexed; cameras and lights as
//! nodes. Triangles come out grouped by material, otherwise in their order.

mod document;
mod mesh;
mod objects;
mod weld;

use super::{Scene, Texture};
use crate::atomic_file::write_atomically;
use crate::{Error, Result};
use document::Document;
use mesh::{Mesh, attributes, meshes};
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writes `scene` to `path`, whole or not at all: the file is written beside its final place, synced and
/// renamed. `copyright` goes into the asset. Fails with [`Error::Io`] if the folder or file is not
/// writable and with [`Error::Usage`] if the scene does not fit the format's 4 GiB.
pub fn write(scene: &Scene, path: &Path, copyright: Option<&str>) -> Result<()> {
    let plan = Plan::new(scene, copyright)?;
    write_atomically(path, |out| {
        let mut out = BufWriter::with_capacity(1 << 20, out); // few system calls for gigabytes
        plan.write_to(&mut out).and_then(|()| out.flush()).map_err(Error::io("write", path))
    })
}

/// The bytes that [`write`] would write.
pub fn to_bytes(scene: &Scene, copyright: Option<&str>) -> Result<Vec<u8>> {
    let plan = Plan::new(scene, copyright)?;
    let mut bytes = Vec::with_capacity(plan.file_length() as usize);
    plan.write_to(&mut bytes).map_err(Error::io("write", scene.name.as_str()))?;
    Ok(bytes)
}

/// Everything that has to be known before the first byte: a .glb starts with its lengths and its JSON.
struct Plan<'a> {
    scene: &'a Scene,
    meshes: Vec<Mesh>,
    images: Vec<Vec<u8>>,
    json: Vec<u8>,
    /// Length of the binary chunk, a multiple of 4; no chunk if 0.
    binary_length: u32,
}

impl<'a> Plan<'a> {
    fn new(scene: &'a Scene, copyright: Option<&str>) -> Result<Self> {
        if scene.positions.len() > (u32::MAX / 3) as usize {
            return Err(too_large(scene, 12 * scene.positions.len() as u64));
        }
        let meshes = meshes(scene);
        let images = scene.textures.iter().map(png).collect::<Result<Vec<_>>>()?;
        let mut document = Document::default();
        document.add_meshes(scene, &meshes);
        document.add_textures(&scene.textures, &images);
        document.add_nodes(scene, &meshes);
        let binary_length = document.binary_length.next_multiple_of(4);
        let json = document.finish(scene, copyright).to_string().into_bytes();
        let plan = |binary_length| Plan { scene, meshes, images, json, binary_length };
        match u32::try_from(binary_length) {
            Ok(length) if length < u32::MAX - (64 << 20) => Ok(plan(length)),
            _ => Err(too_large(scene, binary_length)),
        }
    }

    /// JSON chunk length: padded with spaces to a multiple of 4.
    fn json_length(&self) -> u32 {
        self.json.len().next_multiple_of(4) as u32
    }

    fn file_length(&self) -> u32 {
        let binary = if self.binary_length == 0 { 0 } else { 8 + self.binary_length };
        12 + 8 + self.json_length() + binary
    }

    /// Header, JSON chunk, binary chunk (glTF 2.0 section 4.4).
    fn write_to(&self, out: &mut impl Write) -> io::Result<()> {
        let word = |word: u32| word.to_le_bytes();
        out.write_all(b"glTF")?;
        out.write_all(&word(2))?;
        out.write_all(&word(self.file_length()))?;

        out.write_all(&word(self.json_length()))?;
        out.write_all(b"JSON")?;
        out.write_all(&self.json)?;
        out.write_all(&b"   "[..self.json_length() as usize - self.json.len()])?;
        if self.binary_length == 0 {
            return Ok(());
        }

        out.write_all(&word(self.binary_length))?;
        out.write_all(b"BIN\0")?;
        for mesh in &self.meshes {
            for index in &mesh.welded.indices {
                out.write_all(&word(*index))?;
            }
            for attribute in attributes(self.scene, mesh) {
                for &corner in &mesh.welded.first_corners {
                    for component in attribute.of(self.scene, corner) {
                        out.write_all(&component.to_le_bytes())?;
                    }
                }
            }
        }
        for image in &self.images {
            out.write_all(image)?;
            out.write_all(&[0; 3][..image.len().next_multiple_of(4) - image.len()])?;
        }
        Ok(())
    }
}

fn too_large(scene: &Scene, bytes: u64) -> Error {
    Error::usage(
        format!("{}: {bytes} bytes do not fit a .glb file, whose lengths have 32 bits", scene.name),
        "ask for fewer triangles",
    )
}

fn png(texture: &Texture) -> Result<Vec<u8>> {
    use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(texture.texels.as_flattened(), texture.width, texture.height, ExtendedColorType::Rgba8)
        .map_err(|e| Error::usage(format!("texture: {e}"), "give width * height texels"))?;
    Ok(bytes)
}

#[cfg(test)]
mod tests;
