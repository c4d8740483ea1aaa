//! Where a scene comes from: the name for messages and the folder that its files must stay in.

use std::fmt::Display;
use std::path::Path;

use crate::Error;

/// The file being loaded.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    /// As the user named it.
    pub file: &'a Path,
    /// Folder that relative URIs start from; `None` for embedded scenes, which have no files beside them.
    pub folder: Option<&'a Path>,
}

impl Source<'_> {
    /// An [`Error::Input`] about `object` in this file.
    pub fn fault(&self, object: impl Display, problem: impl Into<String>, remedy: impl Into<String>) -> Error {
        Error::input(self.file, object.to_string(), problem, remedy)
    }
}
