//! Documents that cannot be read back.

use crate::correct;

/// A document that cannot be read back.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Not JSON, not of a known schema, or a field is missing or of another type.
    #[error(
        "not a calibration or an audit of truedepth, version 1: {0}. Give a file that `truedepth calibrate --json` \
         or `audit --json` wrote"
    )]
    Document(String),
    /// Numbers that make no camera.
    #[error("not a camera: {0}. Take the file as `truedepth calibrate --json` wrote it")]
    Camera(String),
    /// What was found cannot be corrected.
    #[error(transparent)]
    Correct(#[from] correct::Error),
}
