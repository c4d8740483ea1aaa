//! 8-bit sRGB PNG previews.

use std::path::Path;

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder, ImageError};

use super::aov::Aov;
use super::false_color::{Range, false_color};
use super::image::Image;
use super::tone::display;
use crate::atomic_file::write_atomically;
use crate::{Error, Result};

/// What a preview shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Preview {
    /// R, G, B, tone-mapped; alpha is dropped.
    Color {
        /// Factor on the linear values, 1 as rendered.
        exposure: f32,
    },
    /// An AOV in false colours.
    Aov(Aov),
}

/// Writes a preview of `image` to `path`, whole or not at all. The answer is the range of the colour
/// scale of a scalar AOV.
///
/// # Errors
/// [`Error::Usage`] if the image lacks the channels; [`Error::Io`] or [`Error::Usage`] if `path`
/// cannot be written.
pub fn write(path: &Path, image: &Image, preview: Preview) -> Result<Option<Range>> {
    let (pixels, range) = pixels(image, preview)?;
    write_pixels(path, (image.width(), image.height()), &pixels)?;
    Ok(range)
}

/// Writes sRGB pixels, row-major from the top left, to `path`, whole or not at all.
///
/// # Errors
/// [`Error::Io`] or [`Error::Usage`] if `path` cannot be written.
pub fn write_pixels(path: &Path, (width, height): (usize, usize), pixels: &[[u8; 3]]) -> Result<()> {
    // MAX_SIDE makes both fit.
    let (width, height) = (width as u32, height as u32);
    write_atomically(path, |writer| {
        PngEncoder::new(writer)
            .write_image(pixels.as_flattened(), width, height, ExtendedColorType::Rgb8)
            .map_err(|error| png_error(path, error))
    })
}

fn pixels(image: &Image, preview: Preview) -> Result<(Vec<[u8; 3]>, Option<Range>)> {
    match preview {
        Preview::Color { exposure } => {
            let missing = || Error::usage("a preview needs the channels R, G and B", "render colour");
            let channel = |name| image.floats(name).ok_or_else(missing);
            let (r, g, b) = (channel("R")?, channel("G")?, channel("B")?);
            let colors = r.iter().zip(g).zip(b).map(|((r, g), b)| display([*r, *g, *b], exposure));
            Ok((colors.collect(), None))
        }
        Preview::Aov(aov) => false_color(image, aov).ok_or_else(|| {
            let name = aov.name();
            Error::usage(format!("the picture has no AOV {name} to preview"), format!("add --aov {name}"))
        }),
    }
}

fn png_error(path: &Path, error: ImageError) -> Error {
    match error {
        ImageError::IoError(source) => Error::io("write", path)(source),
        other => Error::Check(format!("{}: the PNG encoder refused the picture: {other}", path.display())),
    }
}

#[cfg(test)]
mod tests {
    use super::super::image::Samples;
    use super::*;

    fn picture() -> Image {
        let mut image = Image::new(3, 2).unwrap();
        for (name, scale) in [("R", 0.1), ("G", 0.2), ("B", 10.0)] {
            image.push(name, Samples::Half((0..6).map(|i| i as f32 * scale).collect())).unwrap();
        }
        image
    }

    #[test]
    fn the_file_holds_the_displayed_colors() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        assert_eq!(write(&path, &picture(), Preview::Color { exposure: 2.0 }).unwrap(), None);
        let read = image::open(&path).unwrap();
        assert_eq!(read.color(), image::ColorType::Rgb8);
        let read = read.into_rgb8();
        assert_eq!(read.dimensions(), (3, 2));
        for (i, pixel) in read.pixels().enumerate() {
            let i = i as f32;
            assert_eq!(pixel.0, display([i * 0.1, i * 0.2, i * 10.0], 2.0));
        }
    }

    #[test]
    fn a_missing_channel_is_a_usage_error_and_no_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let error = write(&path, &picture(), Preview::Aov(Aov::Steps)).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains("--aov steps"), "{error}");
        let empty = Image::new(1, 1).unwrap();
        assert_eq!(write(&path, &empty, Preview::Color { exposure: 1.0 }).unwrap_err().exit_code(), 2);
        assert!(!path.exists());
    }
}
