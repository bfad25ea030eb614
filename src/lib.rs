//! Is the depth of an Apple TrueDepth recording true? And if not, what exactly is wrong, by how much, how sure are
//! we, and what fixes it?
//!
//! The library is a house of rooms, listed here from the ground to the roof. **A room uses only rooms listed above
//! it**; `tests/it/tidy.rs` fails otherwise. Nothing in here prints, exits, reads arguments, the clock, the
//! environment or the network; only [`files`] opens files, and only with the default feature `fs`.
//!
//! The flow of data is the flow of types: [`recording::Recording`] → [`detect::Observation`] → [`pose::View`] →
//! [`calibrate::Calibration`] → [`depth::BoardDepth`] → [`diagnose::Finding`] → [`wire`].
//!
//! Conventions (pixel centres at integers, metres, NaN for "no measurement", `a_from_b`) are stated once, in
//! `CONVENTIONS.md`.

// Comments, not docs: rustdoc shows the sentence on each room's own door.

// ── Ground: shapes and numbers ──

// Transcendental functions, the same bits everywhere.
mod math;

// The same work on one core or all, in narrow vectors or wide ones.
mod par;

// Points, pixels, poses and homographies, with frames as types.
pub mod geom;

// Least squares, robust losses, covariance and statistics; knows no cameras.
pub mod solve;

// ── What exists ──

// Grey, colour and depth images, and how to sample them.
pub mod image;

// Camera models: one file per model.
pub mod camera;

// The printed target: dictionaries and ChArUco geometry.
pub mod board;

// ── What was seen ──

// Named bytes in and out: memory, folders, zip archives, within limits.
pub mod files;

// Recordings, whatever app wrote them: frames in order of time, factory metadata, images on demand.
pub mod recording;

// ChArUco corners of an image, each with its own uncertainty.
pub mod detect;

// ── What follows ──

// Where the board stood in front of the camera.
pub mod pose;

// Intrinsics from many views, with uncertainties.
pub mod calibrate;

// Sensor depth against the depth of the board.
pub mod depth;

// Everything that is measured of a recording before anything is judged, frame by frame.
pub mod measure;

// ── Judgement ──

// Findings: what is wrong, by how much, how sure.
pub mod diagnose;

// The main job: a recording in, everything that can be known of it out.
pub mod audit;

// ── What leaves ──

// Synthetic recordings with ground truth and chosen faults.
pub mod simulate;

// Corrections applied: a recording in, a true one out, with provenance.
pub mod correct;

// The paper's tables and figures, from its published data.
pub mod reproduce;

// For programs: JSON, and calibrations as other programs read them.
pub mod wire;

// For readers: HTML, SVG, words.
pub mod report;
