//! Why a correction cannot be made.

use crate::{camera::OtherSize, files, recording, recording::DefectError};

/// A correction that cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file cannot be read or written.
    #[error(transparent)]
    Recording(#[from] recording::Error),
    /// A file cannot be written.
    #[error(transparent)]
    Files(#[from] files::Error),
    /// Defects that cannot be.
    #[error(transparent)]
    Defect(#[from] DefectError),
    /// The recording lacks what a step needs.
    #[error("{recording}: {step} needs {what}, which the recording does not have; {remedy}")]
    Missing {
        /// Where the recording is.
        recording: String,
        /// The step, by name.
        step: &'static str,
        /// What is missing.
        what: &'static str,
        /// What to do instead.
        remedy: &'static str,
    },
    /// A camera for images of another size.
    #[error(transparent)]
    CameraSize(#[from] OtherSize),
    /// A finding that names no way back.
    #[error("{0}")]
    NoWay(String),
}
