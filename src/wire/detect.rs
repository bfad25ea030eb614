//! Corners of images.

use serde::Serialize;

use super::Document;
use crate::detect::Observation;

/// Corners of images: what `truedepth detect --json` prints.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Detect {
    /// In the order in which they were asked for.
    pub images: Vec<DetectedImage>,
}

/// Corners of one image.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DetectedImage {
    /// As it was asked for; an image inside a recording as `RECORDING/NAME`.
    pub path: String,
    /// Columns and rows.
    pub size_px: [usize; 2],
    /// What was seen of the board: no identity where none was.
    #[serde(flatten)]
    pub observation: Observation,
    /// Milliseconds spent on decoding the image; only where timings were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub decode_ms: Option<f64>,
    /// Milliseconds spent on detecting; only where timings were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub detect_ms: Option<f64>,
}

impl Document for Detect {
    const SCHEMA: &'static str = "truedepth.detect/1";
}
