//! The picture in memory: named planar channels, as they go into a file.

use crate::{Error, Result};

/// Most pixels along one side: OpenEXR's windows are 32-bit boxes, and some readers square them.
pub const MAX_SIDE: usize = 65_535;

/// A picture of `width * height` pixels with any number of channels.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: usize,
    height: usize,
    channels: Vec<Channel>,
}

/// One channel of an [`Image`].
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// OpenEXR name: `R`, `Z`, `N.X`.
    pub name: String,
    /// One value a pixel.
    pub samples: Samples,
}

/// The values of a channel, row-major from the top left, and how a file stores them.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// Stored as 16-bit floats. Kept in full here, so that a preview does not see the rounding.
    Half(Vec<f32>),
    /// Stored as 32-bit floats.
    Float(Vec<f32>),
    /// Stored as 32-bit unsigned integers.
    Uint(Vec<u32>),
}

impl Samples {
    /// Number of values.
    pub fn len(&self) -> usize {
        match self {
            Samples::Half(values) | Samples::Float(values) => values.len(),
            Samples::Uint(values) => values.len(),
        }
    }

    /// Whether there are no values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// How colour is stored; `--depth`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Depth {
    /// 16 bits: range 65,504, three significant digits.
    #[default]
    Half,
    /// 32 bits.
    Float,
}

impl Depth {
    /// Colour samples to be stored with this depth.
    pub fn samples(self, values: Vec<f32>) -> Samples {
        match self {
            Depth::Half => Samples::Half(values),
            Depth::Float => Samples::Float(values),
        }
    }
}

impl Image {
    /// A picture without channels.
    ///
    /// # Errors
    /// [`Error::Usage`] if a side is 0 or above [`MAX_SIDE`].
    pub fn new(width: usize, height: usize) -> Result<Image> {
        if width == 0 || height == 0 || width > MAX_SIDE || height > MAX_SIDE {
            let what = format!("a picture of {width} x {height} pixels cannot be written");
            return Err(Error::usage(what, format!("width and height are 1 to {MAX_SIDE}")));
        }
        Ok(Image { width, height, channels: Vec::new() })
    }

    /// Adds a channel.
    ///
    /// # Errors
    /// [`Error::Check`] if the name is taken or the number of samples is not that of the pixels.
    pub fn push(&mut self, name: &str, samples: Samples) -> Result<()> {
        let (found, expected) = (samples.len(), self.width * self.height);
        if found != expected {
            return Err(Error::Check(format!("channel {name} has {found} samples for {expected} pixels")));
        }
        if self.channel(name).is_some() {
            return Err(Error::Check(format!("two channels are named {name}")));
        }
        self.channels.push(Channel { name: name.to_owned(), samples });
        Ok(())
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All channels in the order in which they were added.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// The channels themselves, for a writer that needs no copy.
    pub fn into_channels(self) -> Vec<Channel> {
        self.channels
    }

    /// The samples of a channel.
    pub fn channel(&self, name: &str) -> Option<&Samples> {
        self.channels.iter().find(|channel| channel.name == name).map(|channel| &channel.samples)
    }

    /// The samples of a half or float channel.
    pub fn floats(&self, name: &str) -> Option<&[f32]> {
        match self.channel(name)? {
            Samples::Half(values) | Samples::Float(values) => Some(values),
            Samples::Uint(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_that_no_file_can_hold_are_usage_errors() {
        for (width, height) in [(0, 1), (1, 0), (0, 0), (MAX_SIDE + 1, 1), (1, usize::MAX)] {
            assert_eq!(Image::new(width, height).unwrap_err().exit_code(), 2);
        }
        Image::new(MAX_SIDE, 1).unwrap();
    }

    #[test]
    fn channels_must_fit_and_differ_in_name() {
        let mut image = Image::new(2, 2).unwrap();
        image.push("Z", Samples::Float(vec![1.0; 4])).unwrap();
        assert!(image.push("Z", Samples::Float(vec![1.0; 4])).is_err());
        assert!(image.push("R", Samples::Half(vec![1.0; 3])).is_err());
        assert_eq!(image.floats("Z"), Some(&[1.0; 4][..]));
        assert_eq!(image.channel("R"), None);
    }
}
