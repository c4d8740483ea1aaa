//! OpenEXR out: any channels, ZIP, and a header that says how the picture was made. `read` is the way back in.

use std::collections::BTreeMap;
use std::path::Path;

use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image as ExrImage, Layer, write::WritableImage};
use exr::meta::attribute::{AttributeValue, LineOrder, Text};
use exr::meta::header::LayerAttributes;
use exr::prelude::{Blocks, Compression};
use glam::Mat4;
use half::f16;

use super::image::{Channel, Image, Samples};
use crate::atomic_file::write_atomically;
use crate::{Error, Result};

pub mod read;

/// What the header tells besides the pixels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metadata {
    /// The scene as the user called it; attribute `scene`.
    pub scene: String,
    /// World to the camera's frame by the conventions of OpenEXR, see
    /// [`camera_matrices`](super::camera_matrices::camera_matrices); attribute `worldToCamera`.
    pub world_to_camera: Mat4,
    /// World to the unit square of the picture, y down; attribute `worldToNDC`.
    pub world_to_ndc: Mat4,
    /// Seed of the random numbers; attribute `seed`, as text because it may exceed OpenEXR's integers.
    pub seed: u64,
    /// Samples per pixel; attribute `spp`, as text like `seed`.
    pub spp: u32,
    /// Name of the Vulkan device, or `twin`; attribute `device`.
    pub device: String,
    /// Seconds from the first to the last ray; float attribute `renderTime`.
    pub render_seconds: f64,
    /// Statistics of the run; each becomes a text attribute `caribou:KEY`.
    pub statistics: BTreeMap<String, String>,
}

/// What had to be changed for the file's number formats.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// Samples beyond the range of a half, stored as +-65504. Worth a warning if not 0.
    pub clamped: usize,
}

/// Writes `image` to `path`, whole or not at all. Takes the image because its channels are moved into
/// the encoder, not copied.
///
/// # Errors
/// [`Error::Check`] if a sample is NaN or infinite: nothing is written, such a picture is a fault of
/// the program. [`Error::Io`] or [`Error::Usage`] if the path cannot be written.
pub fn write(path: &Path, image: Image, metadata: &Metadata) -> Result<Written> {
    write_with(path, image, attributes(metadata))
}

/// Writes a picture that no camera made; each of `texts` becomes a text attribute.
///
/// # Errors
/// Those of [`write`].
pub fn write_plain(path: &Path, image: Image, texts: &[(&str, &str)]) -> Result<Written> {
    let mut attributes = LayerAttributes { software_name: Some(software()), ..LayerAttributes::default() };
    let texts = texts.iter().map(|(name, value)| (text(name), AttributeValue::Text(text(value))));
    attributes.other.extend(texts);
    write_with(path, image, attributes)
}

fn write_with(path: &Path, image: Image, attributes: LayerAttributes) -> Result<Written> {
    check_finite(&image)?;
    let size = (image.width(), image.height());
    let mut clamped = 0;
    let channels = image.into_channels().into_iter().map(|channel| encode(channel, &mut clamped)).collect();
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let layer = Layer::new(size, attributes, encoding, AnyChannels::sort(channels));
    let file = ExrImage::from_layer(layer);
    write_atomically(path, |writer| file.write().to_buffered(writer).map_err(|error| exr_error(path, error)))?;
    Ok(Written { clamped })
}

/// Every NaN and infinity is counted, and the first is named.
fn check_finite(image: &Image) -> Result<()> {
    let (mut count, mut first) = (0, None);
    for channel in image.channels() {
        let Some(values) = image.floats(&channel.name) else { continue };
        for (index, value) in values.iter().enumerate().filter(|(_, value)| !value.is_finite()) {
            count += 1;
            first.get_or_insert((&channel.name, value, index % image.width(), index / image.width()));
        }
    }
    match first {
        None => Ok(()),
        Some((name, value, x, y)) => Err(Error::Check(format!(
            "{count} samples of the picture are NaN or infinite, the first is {value} in channel {name} \
             at pixel ({x}, {y}); no file was written"
        ))),
    }
}

fn encode(channel: Channel, clamped: &mut usize) -> AnyChannel<FlatSamples> {
    let samples = match channel.samples {
        Samples::Half(values) => FlatSamples::F16(values.into_iter().map(|value| to_half(value, clamped)).collect()),
        Samples::Float(values) => FlatSamples::F32(values),
        Samples::Uint(values) => FlatSamples::U32(values),
    };
    AnyChannel::new(text(&channel.name), samples)
}

/// Values beyond the largest half would be stored as infinity; they are stored as that half instead.
fn to_half(value: f32, clamped: &mut usize) -> f16 {
    let max = f16::MAX.to_f32();
    *clamped += usize::from(value.abs() > max);
    f16::from_f32(value.clamp(-max, max))
}

fn attributes(metadata: &Metadata) -> LayerAttributes {
    let mut attributes = LayerAttributes {
        software_name: Some(software()),
        world_to_camera: Some(row_vector_matrix(metadata.world_to_camera)),
        world_to_normalized_device: Some(row_vector_matrix(metadata.world_to_ndc)),
        ..LayerAttributes::default()
    };
    let other = &mut attributes.other;
    let mut add_text = |name: &str, value: &str| other.insert(text(name), AttributeValue::Text(text(value)));
    add_text("scene", &metadata.scene);
    add_text("seed", &metadata.seed.to_string());
    add_text("spp", &metadata.spp.to_string());
    add_text("device", &metadata.device);
    for (key, value) in &metadata.statistics {
        add_text(&format!("caribou:{key}"), value);
    }
    other.insert(text("renderTime"), AttributeValue::F32(metadata.render_seconds as f32));
    attributes
}

fn software() -> Text {
    text(concat!("caribou ", env!("CARGO_PKG_VERSION")))
}

/// OpenEXR's M44f multiplies row vectors from the left and is stored by rows (Imath); that is the
/// transpose of glam's convention stored by columns: the same sixteen numbers in the same order.
fn row_vector_matrix(matrix: Mat4) -> [f32; 16] {
    matrix.to_cols_array()
}

/// UTF-8 as it is: `Text::from` would take it for Latin-1 and panic on anything beyond.
fn text(string: &str) -> Text {
    Text::from_slice_unchecked(string.as_bytes())
}

fn exr_error(path: &Path, error: exr::error::Error) -> Error {
    match error {
        exr::error::Error::Io(source) => Error::io("write", path)(source),
        other => Error::Check(format!("{}: the OpenEXR encoder refused the picture: {other}", path.display())),
    }
}

#[cfg(test)]
mod tests;
