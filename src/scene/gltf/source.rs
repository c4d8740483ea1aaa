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
        Error::input(self.file, shorten(object.to_string()), shorten(problem.into()), remedy)
    }
}

/// Names and URIs in files may have any length; messages may not.
fn shorten(text: String) -> String {
    const LONGEST: usize = 400;
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text,
    }
}
