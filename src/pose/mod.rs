//! Where the board stood in front of the camera. (skeleton: types only)

use crate::{
    detect::Corner,
    geom::{Board, Color, Pose},
};

/// The board seen in one frame.
#[derive(Clone, Debug)]
pub struct View {
    /// Index of the frame in the recording.
    pub frame: usize,
    /// The corners this pose was found from.
    pub corners: Vec<Corner>,
    /// Where the board stands.
    pub color_from_board: Pose<Color, Board>,
    /// Observed minus projected, pixels, for each corner.
    pub residuals_px: Vec<[f64; 2]>,
    /// Root mean square of the residuals' lengths (the 2-D distance, as OpenCV's calibrateCamera), pixels.
    pub rms_px: f64,
}
