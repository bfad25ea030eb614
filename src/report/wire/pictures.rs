//! What was drawn.

use serde::{Deserialize, Serialize};

use super::finite;
use crate::{
    correct::{Rectifier, Step, Treatment},
    recording::Recording,
    report::{After, DepthPictures, Drawn, LensDrawn, Shown},
};

/// Depth over colour.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Overlay {
    /// Name of the recording.
    pub recording: String,
    /// Version of truedepth.
    pub version: String,
    /// `depth` or `edges`.
    pub shown: String,
    /// Depths at the ends of the colours; `null` where each frame has its own.
    pub range_mm: Option<[f64; 2]>,
    /// The corrections shown beside it.
    pub steps: Vec<Step>,
    /// The recording shown beside it.
    pub beside: Option<String>,
    /// In order.
    pub frames: Vec<OverlayFrame>,
    /// Frames without colour or depth.
    pub left_out: Vec<usize>,
    /// Contact sheet and animation.
    pub other_files: Vec<String>,
}

/// One picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OverlayFrame {
    /// Index of the frame.
    pub frame: usize,
    /// What people call it: in the capture app's recordings the timestamp, milliseconds.
    pub id: String,
    /// The picture's name.
    pub file: String,
    /// Part of the depth map without depth: before, and after where there is one.
    pub holes_percent: Vec<f64>,
    /// Median depth, as above; `null` without any.
    pub median_mm: Vec<Option<f64>>,
}

/// Original, forward table, inverse table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Undistort {
    /// Name of the recording.
    pub recording: String,
    /// Version of truedepth.
    pub version: String,
    /// `tables` or `camera`.
    pub lens: String,
    /// `rectified`, `distorted`, `rectified_twice` or `unknown`.
    pub state: String,
    /// Frames in which the board was measured.
    pub n_frames_measured: usize,
    /// Rows and columns of the board in them.
    pub n_lines: usize,
    /// Distance of corners from straight lines; `null` where nothing was measured.
    pub rms_px: Option<TreatmentsInfo>,
    /// In order.
    pub frames: Vec<UndistortFrame>,
}

/// A number for each panel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TreatmentsInfo {
    /// As recorded.
    pub original: f64,
    /// Resampled with the forward table.
    pub forward: f64,
    /// Resampled with the inverse table.
    pub inverse: f64,
}

/// One picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UndistortFrame {
    /// Index of the frame.
    pub frame: usize,
    /// What people call it: in the capture app's recordings the timestamp, milliseconds.
    pub id: String,
    /// The picture's name.
    pub file: String,
    /// As in the whole.
    pub rms_px: Option<TreatmentsInfo>,
}

impl Overlay {
    /// What was drawn.
    pub fn new(pictures: &DepthPictures<'_>, drawn: &Drawn) -> Self {
        let millimetres = |m: f64| finite(1e3 * m);
        let frames = drawn.frames.iter().map(|f| OverlayFrame {
            frame: f.frame,
            id: f.id.clone(),
            file: f.file.clone(),
            holes_percent: f.holes.iter().map(|h| 100.0 * h).collect(),
            median_mm: f.median_m.iter().map(|m| millimetres(*m)).collect(),
        });
        let shown = match pictures.style.shown {
            Shown::Depth => "depth",
            Shown::Edges => "edges",
        };
        Self {
            recording: pictures.recording.name.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            shown: shown.to_owned(),
            range_mm: drawn.range_m.map(|range| range.map(|m| 1e3 * m)),
            steps: match pictures.after {
                After::Corrected(plan) => plan.steps().to_vec(),
                _ => Vec::new(),
            },
            beside: match pictures.after {
                After::Recording(other) => Some(other.name.clone()),
                _ => None,
            },
            frames: frames.collect(),
            left_out: drawn.left_out.clone(),
            other_files: drawn.others.clone(),
        }
    }
}

impl From<[f64; 3]> for TreatmentsInfo {
    /// In the order of [`Treatment::ALL`].
    fn from([original, forward, inverse]: [f64; 3]) -> Self {
        const _: () = assert!(matches!(
            Treatment::ALL,
            [Treatment::Original, Treatment::Forward, Treatment::Inverse]
        ));
        Self { original, forward, inverse }
    }
}

impl Undistort {
    /// What was drawn and measured.
    pub fn new(recording: &Recording, rectifier: &Rectifier, drawn: &LensDrawn) -> Self {
        let frames = drawn.frames.iter().map(|f| UndistortFrame {
            frame: f.frame,
            id: f.id.clone(),
            file: f.file.clone(),
            rms_px: f.rms_px.map(TreatmentsInfo::from),
        });
        Self {
            recording: recording.name.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            lens: rectifier.name().to_owned(),
            state: drawn.straightness.state().name().to_owned(),
            n_frames_measured: drawn.straightness.n_frames(),
            n_lines: drawn.straightness.n_lines(),
            rms_px: drawn.straightness.rms_px().map(TreatmentsInfo::from),
            frames: frames.collect(),
        }
    }
}
