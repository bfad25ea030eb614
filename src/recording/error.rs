//! Why a recording cannot be read or written.

use crate::{files, image};

/// Why a recording cannot be read or written. Every message names the file, the place in it, and the remedy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Nothing here looks like a recording.
    #[error(
        "{path} is not a recording: looked for rgb_<milliseconds>.png, depth_<milliseconds>.png and \
         DepthMetadata.json, found {found}; give the folder that the capture app wrote, or a .zip of it"
    )]
    NotARecording {
        /// What was opened.
        path: String,
        /// What was there instead.
        found: String,
    },
    /// Metadata without a single image.
    #[error(
        "{path} holds metadata but no image (rgb_<milliseconds>.png, depth_<milliseconds>.png): copy the whole \
         folder from the device"
    )]
    NoImages {
        /// The recording.
        path: String,
    },
    /// Several recordings where one is due.
    #[error("{path} holds {} recordings ({}): name one of them", .names.len(), .names.join(", "))]
    Several {
        /// What was opened.
        path: String,
        /// Folders of the recordings inside.
        names: Vec<String>,
    },
    /// A file that cannot be read or written.
    #[error(transparent)]
    Files(#[from] files::Error),
    /// An image that cannot be decoded.
    #[error("{file}: {source}")]
    Image {
        /// The file.
        file: String,
        /// Why.
        source: image::Error,
    },
    /// An image of another size than the metadata says.
    #[error(
        "{file} is {}x{} pixels, but {said_by} says {}x{} for frame {frame}: image and metadata are not of one \
         recording, or one of them was changed; copy both from the device again",
        .size[0], .size[1], .expected[0], .expected[1]
    )]
    ImageSize {
        /// The image.
        file: String,
        /// Its columns and rows.
        size: [usize; 2],
        /// The metadata file.
        said_by: String,
        /// Columns and rows there.
        expected: [usize; 2],
        /// What people call the frame.
        frame: String,
    },
    /// A frame without the image that was asked for.
    #[error("{path} has no {what} at frame {frame}: use the frames that have one")]
    Absent {
        /// The recording.
        path: String,
        /// What was asked for.
        what: &'static str,
        /// Index of the frame.
        frame: usize,
    },
    /// Metadata that end too early.
    #[error(
        "{file} ends in the middle of record {record} (byte {bytes}): copy it from the device again, or keep its \
         {} whole records by ending it with `]` after the last of them",
        .record - 1
    )]
    MetadataCut {
        /// The metadata file.
        file: String,
        /// The record that is cut, counted from 1.
        record: usize,
        /// Length of the file, bytes.
        bytes: usize,
    },
    /// Metadata that are not what they should be.
    #[error(
        "{file}, record {record}, line {line}, column {column}: {why}, at `{text}`; copy the file from the device \
         again, or correct that line"
    )]
    Metadata {
        /// The metadata file.
        file: String,
        /// The record, counted from 1.
        record: usize,
        /// Line, counted from 1.
        line: usize,
        /// Column, counted from 1.
        column: usize,
        /// What is wrong.
        why: String,
        /// The line, shortened.
        text: String,
    },
    /// A number that no camera can have.
    #[error(
        "{file}, record {record} (timestamp {timestamp}): {key} is {value}, it must be {valid}; copy the file from \
         the device again, or correct that value"
    )]
    Value {
        /// The metadata file.
        file: String,
        /// The record, counted from 1.
        record: usize,
        /// Its timestamp.
        timestamp: i64,
        /// The key.
        key: &'static str,
        /// The value there.
        value: String,
        /// What is accepted.
        valid: String,
    },
    /// A description of the board that cannot be used.
    #[error("{file}: {why}")]
    Board {
        /// The file.
        file: String,
        /// What is wrong, and the remedy.
        why: String,
    },
}
