//! The printed target: dictionaries and ChArUco geometry.
//!
//! A [`CharucoBoard`] is a chessboard whose white squares carry markers of a [`Dictionary`]. Its inner corners have
//! ids row by row from the first square, as OpenCV's `getChessboardCorners()` (4.6 and newer) counts them, in the
//! frame [`Board`](crate::geom::Board): x along a row, y down the rows, z into the board.
//!
//! ```
//! use truedepth::board::CharucoBoard;
//!
//! let board: CharucoBoard = "10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL".parse()?;
//! assert_eq!(board.n_corners(), 63);
//! assert_eq!(board.corner(0).x(), 0.020875);
//! # Ok::<(), truedepth::board::Error>(())
//! ```
//!
//! A [`Sheet`] is the board on [`Paper`], true to scale, with a ruler to check the print: rectangles and lines of text
//! in millimetres, for [`report`](crate::report) to turn into PDF, SVG or PNG.
//!
//! Not here: files (`board.toml` is read by [`recording`](crate::recording)), detection, file formats.

mod charuco;
mod dictionary;
mod dictionary_file;
mod length;
mod sheet;

pub use charuco::{CharucoBoard, Layout, MarkerCell};
pub use dictionary::Dictionary;
pub use length::{length_m, length_text};
pub use sheet::{Orientation, Paper, Rect, Sheet, Text};

/// A board that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A length that is no number with a unit.
    #[error(
        "`{0}` is not a length: give a number with its unit, like 20.875mm (units: mm, cm, m, in)"
    )]
    Length(String),
    /// A dictionary nobody knows.
    #[error(
        "`{0}` is not a known dictionary; known are {known}, and files of OpenCV's form, like mine.yml",
        known = Dictionary::NAMES.join(", ")
    )]
    Dictionary(String),
    /// Text that does not follow the short form of a board.
    #[error(
        "`{0}` does not describe a board: write SQUARES_XxSQUARES_Y:SQUARE:MARKER:DICTIONARY, \
         like 10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL (a `:legacy` or `:new` layout may follow)"
    )]
    Form(String),
    /// Lengths or counts that make no board.
    #[error("not a board: {0}")]
    Geometry(String),
    /// A file that holds no dictionary.
    #[error("{file}, line {line}: {why}")]
    DictionaryFile {
        /// The name of the file.
        file: String,
        /// The line, counted from 1.
        line: usize,
        /// What is wrong, and the remedy.
        why: String,
    },
    /// A board larger than the paper.
    #[error("a board of {board} does not fit on {paper}: {remedy}")]
    Paper {
        /// Its size.
        board: String,
        /// The paper, and the room on it.
        paper: String,
        /// The largest square that fits, and the paper on which the board does.
        remedy: String,
    },
}
