//! Pictures that cannot be drawn.

use crate::{correct, files, recording};

/// A picture that cannot be drawn.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file of the recording cannot be read, or a picture not be written.
    #[error(transparent)]
    Recording(#[from] recording::Error),
    /// A file cannot be written.
    #[error(transparent)]
    Files(#[from] files::Error),
    /// The correction to be shown cannot be made.
    #[error(transparent)]
    Correct(#[from] correct::Error),
    /// No frame has what is to be drawn.
    #[error("{recording}: none of the {n_frames} frames asked for has {what}; {remedy}")]
    NothingToDraw {
        /// Where the recording is.
        recording: String,
        /// Frames asked for.
        n_frames: usize,
        /// What is missing.
        what: &'static str,
        /// What to do about it.
        remedy: &'static str,
    },
    /// Colour and depth, or before and after, differ in size.
    #[error(
        "{recording}, frame {frame}: {} is {}x{} pixels, {} is {}x{}: they cannot be laid over each other; record both \
         at one size (640x480)",
        .what[0], .sizes[0][0], .sizes[0][1], .what[1], .sizes[1][0], .sizes[1][1]
    )]
    Sizes {
        /// Where the recording is.
        recording: String,
        /// Index of the frame.
        frame: usize,
        /// What they are.
        what: [&'static str; 2],
        /// Columns and rows of each.
        sizes: [[usize; 2]; 2],
    },
    /// A frame that is not there.
    #[error("{recording} has {n_frames} frames, 0 to {}: there is no frame {frame}", .n_frames.saturating_sub(1))]
    NoFrame {
        /// Where the recording is.
        recording: String,
        /// Frames it has.
        n_frames: usize,
        /// As asked for.
        frame: usize,
    },
}
