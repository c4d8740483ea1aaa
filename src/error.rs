//! The one error type. Its variants decide the exit code; its text names the file, the object and
//! the remedy.

use std::path::PathBuf;

/// Result of everything in this crate that can fail.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What went wrong, who is to blame for it (exit code), and what to do.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A scene or other input file is not usable as it is. Exit code 2.
    #[error("{}: {object}: {problem}; {remedy}", file.display())]
    Input {
        /// The file as the user named it.
        file: PathBuf,
        /// The object inside the file, e.g. `accessor 3`, `node 7`, `header`.
        object: String,
        /// What is wrong with it, with the numbers.
        problem: String,
        /// What the user can do about it.
        remedy: String,
    },
    /// An argument is out of range or names something that does not exist. Exit code 2.
    #[error("{what}; {remedy}")]
    Usage {
        /// The argument and what is wrong with it.
        what: String,
        /// The allowed range or the known names.
        remedy: String,
    },
    /// A file could not be read (exit code 2) or written (exit code 2 as well: the path is the user's).
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// `read`, `write`, `create`, `rename`.
        action: &'static str,
        /// The path concerned.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The Vulkan driver failed or lacks something. Exit code 1.
    #[error("{stage}: {problem}; {remedy}")]
    Device {
        /// The stage that was running, e.g. `trace closest`, `allocate nodes`.
        stage: String,
        /// The driver's answer.
        problem: String,
        /// What the user can do about it.
        remedy: String,
    },
    /// A check that the program makes of its own results failed. Exit code 1.
    #[error("check failed: {0}")]
    Check(String),
}

impl Error {
    /// 2 for bad input or usage, 1 for work that failed.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Input { .. } | Error::Usage { .. } | Error::Io { .. } => 2,
            Error::Device { .. } | Error::Check(_) => 1,
        }
    }

    /// An [`Error::Input`]; the arguments read in the order of the message.
    pub fn input(
        file: impl Into<PathBuf>,
        object: impl Into<String>,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Error::Input { file: file.into(), object: object.into(), problem: problem.into(), remedy: remedy.into() }
    }

    /// An [`Error::Usage`].
    pub fn usage(what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Error::Usage { what: what.into(), remedy: remedy.into() }
    }

    /// An [`Error::Device`].
    pub fn device(stage: impl Into<String>, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Error::Device { stage: stage.into(), problem: problem.into(), remedy: remedy.into() }
    }

    /// An [`Error::Io`] for `map_err`.
    pub fn io(action: &'static str, path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Error::Io { action, path, source }
    }
}
