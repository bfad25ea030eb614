//! Corners of images.

use serde::{Deserialize, Serialize};

use super::finite;
use crate::detect::{Corner, Identity, Observation, Reject};

/// Corners of images.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Detect {
    /// In the order in which they were asked for.
    pub images: Vec<DetectedImage>,
}

/// Corners of one image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DetectedImage {
    /// As it was asked for; an image inside a recording as `RECORDING/NAME`.
    pub path: String,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Whether a board was identified.
    pub board_found: bool,
    /// `legacy` or `new`, where a board was found.
    pub layout: Option<String>,
    /// How the board was told from all others; only where one was found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub identity: Option<DetectedIdentity>,
    /// By ascending id.
    pub corners: Vec<DetectedCorner>,
    /// Candidates that were not taken.
    pub rejected: Vec<RejectedCorner>,
    /// Milliseconds spent on decoding the image; only where timings were asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub decode_ms: Option<f64>,
    /// Milliseconds spent on detecting; only where timings were asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub detect_ms: Option<f64>,
}

impl DetectedImage {
    /// What was seen in the image at `path`, of `size_px` columns and rows; without timings.
    pub fn new(path: String, size_px: [usize; 2], observation: &Observation) -> Self {
        let [width, height] = size_px;
        Self {
            path,
            width,
            height,
            board_found: observation.identity.is_some(),
            layout: observation.identity.as_ref().map(|identity| identity.layout.name().to_owned()),
            identity: observation.identity.as_ref().map(DetectedIdentity::from),
            corners: observation.corners.iter().map(DetectedCorner::from).collect(),
            rejected: observation.rejects.iter().map(RejectedCorner::from).collect(),
            decode_ms: None,
            detect_ms: None,
        }
    }
}

/// How a board was told from all others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DetectedIdentity {
    /// The image shows the board mirrored; ids are still those of the board.
    pub mirrored: bool,
    /// Black and white are exchanged on the print.
    pub inverted: bool,
    /// Markers that voted.
    pub n_markers: usize,
    /// Their ids, ascending.
    #[serde(default)]
    pub marker_ids: Vec<usize>,
    /// Lead over the runner-up placement, as a log-likelihood ratio in nats.
    pub margin_nats: Option<f64>,
}

impl From<&Identity> for DetectedIdentity {
    fn from(identity: &Identity) -> Self {
        let Identity { mirrored, inverted, ref markers, margin, .. } = *identity;
        Self {
            mirrored,
            inverted,
            n_markers: markers.len(),
            marker_ids: markers.clone(),
            margin_nats: finite(margin),
        }
    }
}

/// One corner of the board in an image; integer coordinates are pixel centres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DetectedCorner {
    /// As OpenCV ≥ 4.6 counts.
    pub id: usize,
    /// Column.
    pub x_px: f64,
    /// Row.
    pub y_px: f64,
    /// Standard deviation of each coordinate.
    pub sigma_px: Option<f64>,
}

impl From<&Corner> for DetectedCorner {
    fn from(corner: &Corner) -> Self {
        Self {
            id: corner.id,
            x_px: corner.pixel.x,
            y_px: corner.pixel.y,
            sigma_px: finite(corner.sigma_px),
        }
    }
}

/// A candidate that was not taken.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RejectedCorner {
    /// Why, in snake case.
    pub reason: String,
    /// Column.
    pub x_px: f64,
    /// Row.
    pub y_px: f64,
}

impl From<&Reject> for RejectedCorner {
    fn from(reject: &Reject) -> Self {
        Self { reason: reject.reason.name().to_owned(), x_px: reject.pixel.x, y_px: reject.pixel.y }
    }
}
