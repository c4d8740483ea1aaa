//! Images to textures: PNG and JPEG, decoded within bounds and once for each use.

use std::collections::HashMap;
use std::io::Cursor;

use gltf::json::texture::WrappingMode;
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits, RgbaImage};

use super::buffers::Buffers;
use super::source::Source;
use super::uri::Reader;
use crate::Result;
use crate::scene::{Texture, Wrap};

/// Longest side of an image in texels.
const MAX_SIDE: u32 = 16_384;
/// Texels of all textures together: 4 GiB.
const MAX_TEXELS: u64 = 1 << 30;
/// What decoding one image may allocate: 16-bit RGBA of the longest sides.
const MAX_DECODER_BYTES: u64 = 8 * (MAX_SIDE as u64 * MAX_SIDE as u64);

/// Decodes textures on demand.
pub(super) struct Textures<'a> {
    source: Source<'a>,
    root: &'a Root,
    buffers: &'a Buffers<'a>,
    reader: Reader<'a>,
    texels: u64,
    known: HashMap<(usize, [u8; 2]), u32>,
    means: HashMap<(usize, Encoding), [f32; 3]>,
    decoded: Vec<Texture>,
}

impl<'a> Textures<'a> {
    pub fn new(source: Source<'a>, root: &'a Root, buffers: &'a Buffers<'a>, reader: Reader<'a>) -> Self {
        let (known, means) = Default::default();
        Textures { source, root, buffers, reader, texels: 0, known, means, decoded: Vec::new() }
    }

    /// Index of a texture in [`Textures::into_decoded`].
    pub fn base_color(&mut self, index: Index<gltf::json::Texture>) -> Result<u32> {
        let texture = &self.root.textures[index.value()];
        let wrap = match texture.sampler.map(|sampler| &self.root.samplers[sampler.value()]) {
            None => [Wrap::Repeat; 2],
            Some(sampler) => [wrap(&sampler.wrap_s), wrap(&sampler.wrap_t)],
        };
        let key = (texture.source.value(), wrap.map(|w| w as u8));
        if let Some(&known) = self.known.get(&key) {
            return Ok(known);
        }
        let image = self.decode(texture.source.value())?;
        let (width, height) = image.dimensions();
        let texels = image.pixels().map(|pixel| pixel.0).collect();
        let slot = self.decoded.len() as u32;
        self.decoded.push(Texture { width, height, texels, wrap });
        self.known.insert(key, slot);
        Ok(slot)
    }

    /// Mean colour, linear: what stands in for textures that the integrator does not sample.
    pub fn mean(&mut self, index: Index<gltf::json::Texture>, encoding: Encoding) -> Result<[f32; 3]> {
        let image = self.root.textures[index.value()].source.value();
        if let Some(&known) = self.means.get(&(image, encoding)) {
            return Ok(known);
        }
        let pixels = self.decode(image)?;
        let mut sums = [0.0f64; 3];
        for pixel in pixels.pixels() {
            (0..3).for_each(|c| sums[c] += encoding.linear(pixel.0[c]));
        }
        let count = f64::from(pixels.width()) * f64::from(pixels.height());
        let mean = sums.map(|sum| (sum / count) as f32);
        self.means.insert((image, encoding), mean);
        Ok(mean)
    }

    /// The decoded textures.
    pub fn into_decoded(self) -> Vec<Texture> {
        self.decoded
    }

    fn decode(&mut self, index: usize) -> Result<RgbaImage> {
        let object = format!("image {index}");
        let image = &self.root.images[index];
        let shared;
        let bytes: &[u8] = match (image.buffer_view, &image.uri) {
            (Some(view), _) => self.buffers.view(view),
            (None, uri) => {
                shared = self.reader.read(&object, uri.as_deref().unwrap_or_default())?;
                &shared
            }
        };
        let fault = |problem: String| {
            let remedy = "use a PNG or JPEG image that other programs open";
            self.source.fault(&object, problem, remedy)
        };
        let mut reader = ImageReader::new(Cursor::new(bytes))
            .with_guessed_format()
            .map_err(|error| fault(format!("cannot be read: {error}")))?;
        if !matches!(reader.format(), Some(ImageFormat::Png | ImageFormat::Jpeg)) {
            return Err(fault("is neither PNG nor JPEG".into()));
        }
        let mut limits = Limits::default();
        (limits.max_image_width, limits.max_image_height) = (Some(MAX_SIDE), Some(MAX_SIDE));
        limits.max_alloc = Some(MAX_DECODER_BYTES);
        reader.limits(limits);
        let decoder = reader.into_decoder().map_err(|error| fault(format!("does not decode: {error}")))?;
        let (width, height) = decoder.dimensions();
        self.texels += u64::from(width) * u64::from(height);
        if self.texels > MAX_TEXELS {
            return Err(fault(format!("makes {} texels in all, more than {MAX_TEXELS}", self.texels)));
        }
        let image = DynamicImage::from_decoder(decoder).map_err(|error| fault(format!("does not decode: {error}")))?;
        Ok(image.into_rgba8())
    }
}

/// What the bytes of an image mean.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Encoding {
    /// Colour (IEC 61966-2-1).
    Srgb,
    /// Data.
    Linear,
}

impl Encoding {
    fn linear(self, byte: u8) -> f64 {
        let x = f64::from(byte) / 255.0;
        match self {
            Encoding::Linear => x,
            Encoding::Srgb if x <= 0.04045 => x / 12.92,
            Encoding::Srgb => ((x + 0.055) / 1.055).powf(2.4),
        }
    }
}

fn wrap(mode: &Checked<WrappingMode>) -> Wrap {
    match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        // `references` refuses invalid values.
        Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
    }
}
