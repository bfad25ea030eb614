//! Why files cannot be read or written.

use std::io;

/// Why files cannot be read or written. Every message names the file and the remedy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file that cannot be read or written.
    #[error("{file}: {why}; check that it is there, and that you have the right to it")]
    File {
        /// The file.
        file: String,
        /// What the system said.
        why: String,
    },
    /// A place for files that is taken.
    #[error("{file}: {why}")]
    Taken {
        /// The file or folder.
        file: String,
        /// Why, and the remedy.
        why: String,
    },
    /// An archive that cannot be used.
    #[error("{file}: {why}")]
    Archive {
        /// The archive.
        file: String,
        /// What is wrong, and the remedy.
        why: String,
    },
    /// More than the limits allow.
    #[error("{file}: {what}; if you trust it, raise the limits")]
    Limit {
        /// The file or folder.
        file: String,
        /// What is more than which limit.
        what: String,
    },
}

impl Error {
    /// What the system said of a file.
    pub(crate) fn io(file: &str, error: &io::Error) -> Self {
        Self::File { file: file.to_owned(), why: error.to_string() }
    }
}
