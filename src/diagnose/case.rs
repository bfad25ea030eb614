//! What a diagnosis starts from.

use super::{Device, DistortionState, Finding, Tolerances};
use crate::{
    board::CharucoBoard,
    calibrate::Calibration,
    camera::Camera,
    depth::BoardDepth,
    detect::Observation,
    pose::View,
    recording::{Factory, Problem},
};

/// Everything known before anything is judged.
#[derive(Clone, Copy, Debug)]
pub struct Case<'a> {
    /// What was odd in the files.
    pub problems: &'a [Problem],
    /// Frames of the recording.
    pub n_frames: usize,
    /// Columns and rows of the colour images, where one was read.
    pub size_px: Option<[usize; 2]>,
    /// The factory's metadata.
    pub factory: Option<&'a Factory>,
    /// The board that was looked for.
    pub board: &'a CharucoBoard,
    /// What was seen of it, frame by frame.
    pub observations: &'a [&'a Observation],
    /// The own intrinsics.
    pub calibration: Option<&'a Calibration>,
    /// Why there is no calibration.
    pub no_calibration: Option<&'a str>,
    /// The own camera, calibrated or given.
    pub camera: Option<&'a Camera>,
    /// The board's poses with the factory's intrinsics taken as an ideal pinhole.
    pub factory_views: &'a [&'a View],
    /// The board's poses with the own camera.
    pub own_views: &'a [&'a View],
    /// Depth against the board with the factory's intrinsics.
    pub factory_depth: Option<&'a BoardDepth>,
    /// Depth against the board with the own camera.
    pub own_depth: Option<&'a BoardDepth>,
    /// What still counts as true.
    pub tolerances: Tolerances,
}

/// One finding per check, in order of their codes, and what they say about the stream's distortion.
pub fn diagnose(case: &Case<'_>) -> (Vec<Finding>, DistortionState) {
    let _ = (case, Device::from_factory(case.factory));
    (Vec::new(), DistortionState::Unknown)
}
