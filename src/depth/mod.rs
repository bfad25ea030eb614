//! Sensor depth against the depth of the board.
//!
//! Where the board is known to stand, the true depth of each of its corners is known too. [`sense`] reads a depth map
//! at the corners as observed; [`against_board`] compares with the corners of the [`View`](crate::pose::View) of the
//! same frame and gives a [`BoardDepth`]: an error per [`Sample`], a median per [`FrameDepth`], the mean of the
//! medians, as the paper does it.
//!
//! [`patches`] keeps the board's whole surface of a depth map, and [`register`] takes those of all views to a
//! [`Registration`]: scale and bias of the sensor, zoom and shift of the depth map against the colour image, with their
//! covariance and the [`Pattern`] that is left. [`handedness`] tells a mirrored depth map, [`NoiseBetweenFrames`] what
//! comes and goes between frames in which nothing moved.
//!
//! The sign is the paper's (arXiv:2201.10865, section 4.2): **error = board depth − sensor depth**, along the optical
//! axis. Apple's depth maps are aligned with the colour image as it is, distorted or not, so the map is read at the
//! corner as observed, never at its rectified place.
//!
//! ```
//! use truedepth::{
//!     board::CharucoBoard, depth::{against_board, sense}, detect::Corner, geom::{Pixel, Pose, Rotation, Vector3},
//!     image::DepthMap, pose::View,
//! };
//!
//! let board = CharucoBoard::paper(0.020875)?;
//! let view = View {
//!     frame: 0,
//!     corners: vec![Corner { id: 0, pixel: Pixel::new(3.5, 2.0), sigma_px: 0.1 }],
//!     color_from_board: Pose::new(Rotation::identity(), Vector3::new(0.0, 0.0, 0.200)),
//!     residuals_px: vec![[0.0; 2]],
//!     rms_px: 0.0,
//! };
//! let map = DepthMap::new(8, 6, vec![0.198; 48]);
//! let depth = against_board(&board, None, &[(&view, &sense(&map, &view.corners))]);
//! let error_m = depth.frames[0].median_error_m.expect("one corner");
//! assert!((error_m - 0.002).abs() < 1e-7); // the sensor measures 2 mm too near
//! # Ok::<(), truedepth::board::Error>(())
//! ```
//!
//! Not here: verdicts ([`diagnose`](crate::diagnose)), images other than depth maps.

mod against_board;
mod between;
mod handedness;
mod imprint;
mod join;
mod patch;
mod pattern;
mod rays;
mod register;
mod relief;
mod stance;
mod temporal;
#[cfg(test)]
mod test_noise;
mod texture;

pub(crate) use against_board::corner_on;
pub use against_board::{BoardDepth, FrameDepth, MAX_ERROR_M, Sample, against_board, sense};
pub use handedness::{CornerDepth, Handedness, handedness};
pub use imprint::Imprint;
pub use patch::{DepthSteps, Patch, Patches, patches};
pub use pattern::{Holes, MAX_INCIDENCE_DEG, NEAR_M, Pattern, PatternCell};
pub use register::{OtherState, RegisterInput, Registration, Slopes, register};
pub use temporal::{Lattice, NoiseAtRange, NoiseBetweenFrames, STILL_PX, TemporalNoise};
pub use texture::Texture;
