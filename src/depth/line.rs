//! Scale and bias of the sensor.

use crate::{board::CharucoBoard, calibrate::Estimate, depth::FrameDepth};

/// The straight line through all samples,
///
/// ```text
/// sensor = scale · board + bias
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct DepthLine {
    /// 1 for a true sensor.
    pub scale: Estimate,
    /// Where the line meets board = 0, metres. Strongly correlated with the scale: see `correlation`.
    pub bias_m: Estimate,
    /// Correlation of scale and bias, −1 to 1.
    pub correlation: f64,
    /// Mean depth of the board over the samples, metres.
    pub center_m: f64,
    /// Sensor minus board at `center_m`, metres: what the two amount to where the data lie.
    pub offset_m: Estimate,
    /// Smallest and largest depth of the board, metres.
    pub range_m: [f64; 2],
    /// Robust standard deviation of the samples about the line, metres.
    pub residual_m: f64,
    /// Samples.
    pub n_samples: usize,
    /// Frames they come from.
    pub n_frames: usize,
}

impl DepthLine {
    /// `None` for fewer than 20 samples, fewer than 3 frames, or a single depth.
    pub(super) fn fit(_board: &CharucoBoard, _frames: &[FrameDepth]) -> Option<Self> {
        None
    }
}
