//! OpenEXR in: any file whose parts are flat and of one size.

use std::io;
use std::path::Path;

use exr::error::Error as ExrError;
use exr::image::FlatSamples;
use exr::meta::MetaData;
use exr::meta::header::Header;
use exr::prelude::read_all_flat_layers_from_file;

use super::super::image::{Image, MAX_SIDE, Samples};
use crate::{Error, Result};

/// What a file says before its pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extent {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Channels of all parts.
    pub channels: usize,
}

/// Size and number of channels of the file at `path`.
///
/// # Errors
/// [`Error::Io`] or [`Error::Input`] if it is no such file, or holds what [`read`] does not take: parts of several
/// sizes or places, deep data, subsampled channels.
pub fn extent(path: &Path) -> Result<Extent> {
    let meta = MetaData::read_from_file(path, false).map_err(|error| refused(path, error))?;
    let Some(first) = meta.headers.first() else {
        return Err(Error::input(path, "header", "the file has no parts", "export it again"));
    };
    let (width, height) = (first.layer_size.0, first.layer_size.1);
    let bad = |problem: &str, remedy: &str| Err(Error::input(path, "header", problem, remedy));
    if width > MAX_SIDE || height > MAX_SIDE {
        return bad(&format!("{width} x {height} pixels"), &format!("a side has at most {MAX_SIDE}"));
    }
    let place = |header: &Header| (header.layer_size, header.own_attributes.layer_position);
    if meta.headers.iter().any(|header| place(header) != place(first)) {
        return bad("its parts differ in size or place", "compare files of one part, or of equal ones");
    }
    if meta.headers.iter().any(|header| header.deep) {
        return bad("it holds deep data", "flatten it");
    }
    let mut channels = meta.headers.iter().flat_map(|header| &header.channels.list);
    if channels.any(|channel| (channel.sampling.0, channel.sampling.1) != (1, 1)) {
        return bad("it has subsampled channels", "store all channels at full size");
    }
    Ok(Extent { width, height, channels: meta.headers.iter().map(|header| header.channels.list.len()).sum() })
}

/// All channels of all parts of the file at `path`; those of several parts are called `part.channel`.
///
/// # Errors
/// Those of [`extent`], and [`Error::Input`] if the pixels are damaged.
pub fn read(path: &Path) -> Result<Image> {
    let Extent { width, height, .. } = extent(path)?;
    let file = read_all_flat_layers_from_file(path).map_err(|error| refused(path, error))?;
    let several = file.layer_data.len() > 1;
    let mut image = Image::new(width, height)?;
    for layer in file.layer_data {
        let part = layer.attributes.layer_name.filter(|_| several).map(|name| format!("{name}."));
        for channel in layer.channel_data.list {
            let name = format!("{}{}", part.as_deref().unwrap_or_default(), channel.name);
            let samples = match channel.sample_data {
                FlatSamples::F16(values) => Samples::Half(values.into_iter().map(f32::from).collect()),
                FlatSamples::F32(values) => Samples::Float(values),
                FlatSamples::U32(values) => Samples::Uint(values),
            };
            let unusable = |_| Error::input(path, format!("channel {name}"), "it occurs twice", "rename one");
            image.push(&name, samples).map_err(unusable)?;
        }
    }
    Ok(image)
}

fn refused(path: &Path, error: ExrError) -> Error {
    match error {
        ExrError::Io(source) if source.kind() != io::ErrorKind::UnexpectedEof => Error::io("read", path)(source),
        other => Error::input(path, "file", format!("no readable OpenEXR file ({other})"), "give an .exr file"),
    }
}
