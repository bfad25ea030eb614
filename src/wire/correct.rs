//! What was corrected: `provenance.json`.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{Distortion, Document};
use crate::{
    camera::Intrinsics,
    correct::{Corrected, Plan, Step},
    diagnose::Finding,
    recording::Recording,
};

/// What was corrected, and from what: what `truedepth correct --json` prints and `provenance.json` holds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Correct {
    /// Name of the input.
    pub recording: String,
    /// SHA-256 of what `sha256sum *` prints in the input's folder.
    pub input_sha256: String,
    /// What was removed, and why.
    pub steps: Vec<Step>,
    /// The lens that rectified the images, where that was not the recording's own tables.
    pub lens: Option<Distortion>,
    /// `edge-aware` or `nearest`.
    pub depth_sampling: String,
    /// The pinhole that the metadata said.
    pub factory_before: Option<PinholeInfo>,
    /// The pinhole that they say now.
    pub factory_after: Option<PinholeInfo>,
    /// Frames written.
    pub n_frames: usize,
    /// Depth measurements in all depth maps that were rewritten, before and after.
    pub n_depths: [u64; 2],
    /// Files of the input that were left out, because they do not count there either.
    pub left_out: Vec<String>,
    /// The findings that asked for it; empty where no audit did.
    pub findings: Vec<Finding>,
    /// Every file of the input.
    pub files: BTreeMap<String, String>,
    /// What the input's own `provenance.json` said, where it was a corrected recording already.
    pub previous: Option<serde_json::Value>,
}

/// A pinhole.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PinholeInfo {
    /// Focal lengths.
    pub focal_xy_px: [f64; 2],
    /// Principal point.
    pub principal_point_px: [f64; 2],
    /// Columns and rows.
    pub image_size_px: [usize; 2],
}

impl Document for Correct {
    const SCHEMA: &'static str = "truedepth.correct/1";
}

impl Correct {
    /// What was done to `recording` by `plan`, which the faults among `findings` asked for.
    pub fn new(
        recording: &Recording,
        plan: &Plan,
        done: Corrected,
        findings: Vec<Finding>,
    ) -> Self {
        let previous = done.previous.as_ref().map(|bytes| {
            let text = String::from_utf8_lossy(bytes);
            serde_json::from_str(&text).unwrap_or_else(|_| serde_json::Value::from(text.as_ref()))
        });
        Self {
            recording: recording.name.clone(),
            input_sha256: done.input_sha256,
            steps: plan.steps().to_vec(),
            lens: plan.camera().map(|camera| Distortion::from(&camera.distortion)),
            depth_sampling: plan.sampling().name().to_owned(),
            factory_before: done.before.as_ref().map(PinholeInfo::from),
            factory_after: done.after.as_ref().map(PinholeInfo::from),
            n_frames: done.n_frames,
            n_depths: done.n_depths,
            left_out: done.left_out,
            findings,
            files: done.files.into_iter().map(|f| (f.name, f.sha256)).collect(),
            previous,
        }
    }
}

impl From<&Intrinsics> for PinholeInfo {
    fn from(k: &Intrinsics) -> Self {
        Self {
            focal_xy_px: [k.fx, k.fy],
            principal_point_px: [k.cx, k.cy],
            image_size_px: [k.width, k.height],
        }
    }
}
