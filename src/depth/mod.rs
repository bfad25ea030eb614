//! Sensor depth against the depth of the board.
//!
//! Where the board is known to stand, the true depth of each of its corners is known too. [`sense`] reads a depth map
//! at the corners as observed; [`against_board`] compares with the corners of the [`View`](crate::pose::View) of the
//! same frame and gives a [`BoardDepth`]: an error per [`Sample`], a median per [`FrameDepth`], the mean of the
//! medians, and a [`DepthLine`] (scale and bias of the sensor).
//!
//! The sign is the paper's (arXiv:2201.10865, section 4.2): **error = board depth − sensor depth**, along the optical
//! axis. Apple's depth maps are aligned with the colour image as it is, distorted or not, so the map is read at the
//! corner as observed, never at its rectified place.
//!
//! Not here: verdicts ([`diagnose`](crate::diagnose)), images other than depth maps.

mod against_board;
mod line;

pub use against_board::{BoardDepth, FrameDepth, MAX_ERROR_M, Sample, against_board, sense};
pub use line::DepthLine;
