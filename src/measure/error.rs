//! Measurements that cannot be made.

use crate::{camera::OtherSize, recording};

/// Measurements that cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file of the recording cannot be read.
    #[error(transparent)]
    Recording(#[from] recording::Error),
    /// Neither the recording nor the caller tells the board.
    #[error(
        "{recording}: the board is not known. Put a board.toml or checkersize.txt into the recording, or give \
         --board 10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL (squares, side, marker side, dictionary)"
    )]
    NoBoard {
        /// Where the recording is.
        recording: String,
    },
    /// No frame has a colour image.
    #[error(
        "{recording}: none of its {n_frames} frames has a colour image, so there is nothing to find the board in; copy \
         the rgb_*.png files, too"
    )]
    NoImages {
        /// Where the recording is.
        recording: String,
        /// Frames in it.
        n_frames: usize,
    },
    /// Colour and depth of one frame differ in shape.
    #[error(
        "{recording}: {color} is {}x{} pixels, {depth} is {}x{}: they differ in shape, so that which depth belongs to \
         which pixel is not known; record both in one shape (like 1440x1920 and 480x640)",
        .color_size[0], .color_size[1], .depth_size[0], .depth_size[1]
    )]
    Sizes {
        /// Where the recording is.
        recording: String,
        /// The colour image.
        color: String,
        /// Its columns and rows.
        color_size: [usize; 2],
        /// The depth image.
        depth: String,
        /// Its columns and rows.
        depth_size: [usize; 2],
    },
    /// A camera from outside for images of another size.
    #[error(transparent)]
    CameraSize(#[from] OtherSize),
    /// A calibration of another camera than the one that recorded: factory focal lengths more than 1.5 % apart.
    #[error(
        "{recording}: the calibration given is of another camera: its factory says {given_px:.1} px of focal length, \
         this recording's says {recorded_px:.1} px; calibrate the device that made this recording"
    )]
    OtherCamera {
        /// Where the recording is.
        recording: String,
        /// The factory's focal length beside the calibration.
        given_px: f64,
        /// The factory's focal length in the recording.
        recorded_px: f64,
    },
}
