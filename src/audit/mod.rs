//! The main job: a recording in, everything that can be known of it out.
//!
//! [`audit`] measures ([`measure`](crate::measure)) and judges ([`diagnose`](crate::diagnose)). Its [`Audit`] holds all
//! that front ends show. Images are decoded, looked at and dropped one by one, so that memory does not grow with the
//! number of frames; with the feature `parallel` frames are looked at on all cores, with the same result bit by bit.
//! Whoever has frames coming one by one, like a phone, drives a [`Measurer`](crate::measure::Measurer) and calls
//! [`judge`].
//!
//! A recording in which no board is seen is not an error: the findings then say "cannot tell", and what to record.
//!
//! ```no_run
//! use truedepth::{
//!     audit::{Options, audit},
//!     files::Limits,
//!     measure::{Method, Silent},
//!     recording::{Recording, StreamState},
//! };
//!
//! let recording = Recording::open("ipad", &Limits::default())?;
//! let audit = audit(&recording, &Options::new(Method::Auto), &Silent)?;
//! for finding in &audit.findings {
//!     println!("{} {}: {}", finding.code, finding.verdict.name(), finding.claim);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Not here: reading arguments, printing, time; pictures and files ([`report`](crate::report)).

#[cfg(test)]
pub(crate) mod sample;
#[cfg(test)]
mod tests;

use std::ops::Deref;

use crate::{
    board::CharucoBoard,
    calibrate::MAX_VIEWS,
    diagnose::{Case, Device, Finding, Tolerances, Verdict, depth_state, diagnose},
    measure::{Error, Measurements, Method, Observer, measure},
    recording::{Recording, StreamState},
};

/// Choices of an audit.
#[derive(Clone, Debug)]
pub struct Options {
    /// Where the measured intrinsics come from.
    pub method: Method,
    /// The board, where the recording does not tell or tells wrong; goes before the recording's own.
    pub board: Option<CharucoBoard>,
    /// What still counts as true.
    pub tolerances: Tolerances,
    /// Calibrate from so many views at most, as [`calibrate_from`](crate::calibrate::calibrate_from).
    pub max_views: usize,
}

impl Options {
    /// This method, the recording's board, default tolerances, views as many as calibrations take.
    pub fn new(method: Method) -> Self {
        Self { method, board: None, tolerances: Tolerances::default(), max_views: MAX_VIEWS }
    }
}

/// Everything that can be known of a recording: what was measured, to which this dereferences, and what follows.
#[derive(Clone, Debug)]
pub struct Audit {
    /// What was measured.
    pub measured: Measurements,
    /// Which camera made it.
    pub device: Device,
    /// Whether the stream still carries the lens' distortion.
    pub distortion_state: StreamState,
    /// The same of the depth maps, which may be resampled without the colour images.
    pub depth_distortion_state: StreamState,
    /// What follows, by code.
    pub findings: Vec<Finding>,
}

impl Deref for Audit {
    type Target = Measurements;

    fn deref(&self) -> &Measurements {
        &self.measured
    }
}

impl Audit {
    /// True where a finding is a fault (exit code 3).
    pub fn has_faults(&self) -> bool {
        self.findings.iter().any(|f| f.verdict == Verdict::Fault)
    }
}

/// Looks at everything; `observer` is told how far it has come.
///
/// Errors: a file that cannot be read or decoded, no board known, no colour image at all, colour and depth of different
/// shape. Everything else is an [`Audit`], if only one whose findings say "cannot tell".
pub fn audit(
    recording: &Recording,
    options: &Options,
    observer: &dyn Observer,
) -> Result<Audit, Error> {
    let board = options.board.as_ref().or(recording.board.as_ref()).cloned();
    let no_board = || Error::NoBoard { recording: recording.place().to_owned() };
    let board = board.ok_or_else(no_board)?;
    let measured = measure(recording, board, &options.method, options.max_views, observer)?;
    Ok(judge(measured, options.tolerances))
}

/// What follows from measurements.
pub fn judge(measured: Measurements, tolerances: Tolerances) -> Audit {
    let frames = &measured.frames;
    let (findings, distortion_state) = diagnose(&Case {
        problems: &measured.problems,
        n_frames: frames.len(),
        size_px: measured.size_px(),
        factory: measured.factory.as_ref(),
        board: &measured.board,
        n_seen: measured.n_frames_with_board(),
        n_mirrored_of: measured.n_mirrored_of(),
        calibration: measured.calibration.as_ref(),
        no_calibration: measured.no_calibration.as_deref(),
        camera: measured.camera.as_ref(),
        given: measured.given.as_ref(),
        factory_depth: measured.factory_depth.as_ref(),
        own_depth: measured.own_depth.as_ref(),
        registration: measured.registration.as_ref(),
        temporal_noise: Some(&measured.temporal_noise),
        distortion: measured.distortion.as_ref(),
        steps: &frames.iter().filter_map(|f| f.patches.as_ref()?.steps).collect::<Vec<_>>(),
        t_ns: &frames.iter().map(|f| f.t_ns).collect::<Vec<_>>(),
        handedness: measured.handedness,
        tolerances,
    });
    let lens_share = measured.registration.as_ref().and_then(|r| r.lens_share);
    let depth_distortion_state = depth_state(distortion_state, lens_share);
    let device = Device::from_factory(measured.factory.as_ref());
    Audit { measured, device, distortion_state, depth_distortion_state, findings }
}
