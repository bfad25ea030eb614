//! What a diagnosis starts from, and the order of the checks.

use super::{
    Finding, Tolerances, findings,
    td201_focal_length::{self, Measured},
    td203_not_rectified,
};
use crate::{
    board::CharucoBoard,
    calibrate::{Calibration, DistortionTest, KnownCamera},
    camera::Camera,
    depth::{BoardDepth, DepthSteps, Handedness, Registration, TemporalNoise},
    recording::{Factory, Problem, StreamState},
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
    /// Frames in which it was seen.
    pub n_seen: usize,
    /// Frames whose markers read only as in a mirror, and all whose markers read.
    pub n_mirrored_of: (usize, usize),
    /// The own intrinsics.
    pub calibration: Option<&'a Calibration>,
    /// Why there is no calibration.
    pub no_calibration: Option<&'a str>,
    /// The own camera, calibrated or given.
    pub camera: Option<&'a Camera>,
    /// Where it is given: what is known of it.
    pub given: Option<&'a KnownCamera>,
    /// Depth against the board with the factory's intrinsics.
    pub factory_depth: Option<&'a BoardDepth>,
    /// Depth against the board with the own camera.
    pub own_depth: Option<&'a BoardDepth>,
    /// Depth against colour and truth with the own camera.
    pub registration: Option<&'a Registration>,
    /// What comes and goes between successive depth maps in which nothing moved; `None` where no depth was looked at.
    pub temporal_noise: Option<&'a TemporalNoise>,
    /// How much of the lens' distortion is left in the stream.
    pub distortion: Option<&'a DistortionTest>,
    /// In what steps depth is stored, for each frame with depth on the board.
    pub steps: &'a [DepthSteps],
    /// Time of each frame since the first, nanoseconds.
    pub t_ns: &'a [i64],
    /// Whether the depth maps are mirrored against the colour images.
    pub handedness: Option<Handedness>,
    /// What still counts as true.
    pub tolerances: Tolerances,
}

/// Corners that a right board and camera leave lie within a tenth of this, pixels; the published evaluation ran on at
/// 4.8 px, when a new OpenCV had changed the board's layout under it.
pub(super) const MAX_RMS_PX: f64 = 1.0;

impl<'a> Case<'a> {
    /// Nothing read and nothing seen yet.
    pub(super) fn unseen(board: &'a CharucoBoard, tolerances: Tolerances) -> Self {
        Self {
            problems: &[],
            n_frames: 0,
            size_px: None,
            factory: None,
            board,
            n_seen: 0,
            n_mirrored_of: (0, 0),
            calibration: None,
            no_calibration: None,
            camera: None,
            given: None,
            factory_depth: None,
            own_depth: None,
            registration: None,
            temporal_noise: None,
            distortion: None,
            steps: &[],
            t_ns: &[],
            handedness: None,
            tolerances,
        }
    }
}

impl Case<'_> {
    /// Why nothing that rests on the own calibration is to be judged, for the end of a sentence; `None` where it fits.
    pub(super) fn poor_fit(&self) -> Option<String> {
        let rms_px = self.calibration?.rms_px;
        (rms_px > MAX_RMS_PX).then(|| {
            format!(
                "the calibration leaves residuals of {rms_px:.2} px, where {MAX_RMS_PX:.1} px is the most that is \
                 relied on: the board is perhaps not the one that was given (squares, layout, size), or not of one \
                 piece"
            )
        })
    }

    /// Why the own camera is not known, for the end of a sentence.
    pub(super) fn why_no_camera(&self) -> String {
        match self.no_calibration {
            Some(why) => why.to_owned(),
            None if self.n_seen == 0 => "the board was not seen in any frame".to_owned(),
            None => "the recording does not determine the camera".to_owned(),
        }
    }
}

/// What several checks start from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known {
    /// What was done to the colour images.
    pub(super) state: StreamState,
    /// The focal length that the recording speaks for.
    pub(super) focal: Option<Measured>,
}

/// One finding per check, in order of their codes, and what they say about the stream's distortion.
pub fn diagnose(case: &Case<'_>) -> (Vec<Finding>, StreamState) {
    let state = td203_not_rectified::state(case);
    // A focal length is comparable with the factory's only once the distortion is out of the way.
    let focal = td201_focal_length::measure(case, state);
    (findings(case, &Known { state, focal }), state)
}
