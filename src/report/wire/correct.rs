//! What was corrected: `provenance.json`.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{Audit, FindingInfo, finite};
use crate::{
    camera::{Camera, Intrinsics},
    correct::{self, Because, Called, Corrected, Lens, Mirrored, Plan, Sampling, Step, Which},
    diagnose::{Code, DistortionState, Verdict},
    recording::Recording,
    report::Error,
};

/// What was corrected, and from what.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Correct {
    /// Name of the input.
    pub recording: String,
    /// Version of truedepth.
    pub version: String,
    /// SHA-256 of what `sha256sum *` prints in the input's folder.
    pub input_sha256: String,
    /// What was done, and why.
    pub steps: Vec<StepInfo>,
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
    pub findings: Vec<FindingInfo>,
    /// Every file of the input.
    pub files: BTreeMap<String, String>,
    /// What the input's own `provenance.json` said, where it was a corrected recording already.
    pub previous: Option<serde_json::Value>,
}

/// One step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepInfo {
    /// `scale-intrinsics`, `focal`, `center`, `undistort`, `mirror`, `zoom`, `shift` or `depth`.
    pub step: String,
    /// Code of a finding, `camera`, `told` or `equations`.
    pub because: String,
    /// What the step took its shape from, where that is no number: `own_tables`, `own_tables_twice`, `tables`,
    /// `camera`, `both`, `depth`.
    pub how: Option<String>,
    /// Its parameters, by name.
    pub parameters: BTreeMap<String, f64>,
}

/// A pinhole.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PinholeInfo {
    /// Focal lengths.
    pub focal_xy_px: [f64; 2],
    /// Principal point.
    pub principal_point_px: [f64; 2],
    /// Columns and rows.
    pub image_size_px: [usize; 2],
}

impl Correct {
    /// What was done to `recording` by `plan`, which the faults among `findings` asked for.
    pub fn new(
        recording: &Recording,
        plan: &Plan,
        done: Corrected,
        findings: Vec<FindingInfo>,
    ) -> Self {
        let previous = done.previous.as_ref().map(|bytes| {
            let text = String::from_utf8_lossy(bytes);
            serde_json::from_str(&text).unwrap_or_else(|_| serde_json::Value::from(text.as_ref()))
        });
        Self {
            recording: recording.name.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            input_sha256: done.input_sha256,
            steps: plan.steps().iter().map(StepInfo::from).collect(),
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

impl From<&(Step, Because)> for StepInfo {
    fn from((step, because): &(Step, Because)) -> Self {
        let camera = |camera: &Camera| {
            let k = &camera.intrinsics;
            let mut numbers =
                vec![("fx_px", k.fx), ("fy_px", k.fy), ("cx_px", k.cx), ("cy_px", k.cy)];
            if let crate::camera::Distortion::Brown(lens) = &camera.distortion {
                let [k1, k2, p1, p2, k3] = lens.parameters();
                numbers.extend([("k1", k1), ("k2", k2), ("p1", p1), ("p2", p2), ("k3", k3)]);
            }
            numbers
        };
        let (how, parameters) = match step {
            Step::ScaleIntrinsics { factor: [x, y] } => {
                (None, vec![("factor_x", *x), ("factor_y", *y)])
            }
            Step::Focal { focal_px } => (None, vec![("focal_px", *focal_px)]),
            Step::Center { center_px: [x, y] } => (None, vec![("cx_px", *x), ("cy_px", *y)]),
            Step::Undistort(Lens::OwnTables) => (Some("own_tables"), Vec::new()),
            Step::Undistort(Lens::OwnTablesTwice) => (Some("own_tables_twice"), Vec::new()),
            Step::Undistort(Lens::Tables(_)) => (Some("tables"), Vec::new()),
            Step::Undistort(Lens::Camera(own)) => (Some("camera"), camera(own)),
            Step::Unmirror(what) => (Some(what.name()), Vec::new()),
            Step::DepthZoom { zoom: [x, y] } => (None, vec![("zoom_x", *x), ("zoom_y", *y)]),
            Step::DepthShift { shift_px: [x, y] } => {
                (None, vec![("shift_x_px", *x), ("shift_y_px", *y)])
            }
            Step::Depth { scale, bias_m } => {
                (None, vec![("scale", *scale), ("bias_mm", 1e3 * bias_m)])
            }
        };
        Self {
            step: step.name().to_owned(),
            because: because.name().to_owned(),
            how: how.map(str::to_owned),
            parameters: parameters
                .into_iter()
                .filter_map(|(name, value)| Some((name.to_owned(), finite(value)?)))
                .collect(),
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

impl Audit {
    /// The findings that are faults.
    pub fn faults(&self) -> impl Iterator<Item = &FindingInfo> {
        self.findings.iter().filter(|f| f.severity == Verdict::Fault.name())
    }

    /// The plan that this audit calls for.
    ///
    /// Errors: a finding of a newer version, a camera that cannot be, a fault that names no way back.
    pub fn plan(&self, which: Which<'_>, sampling: Sampling) -> Result<Plan, Error> {
        let camera = self.calibration.as_ref().map(|c| c.camera()).transpose()?;
        let has_tables = self.device.factory.is_some_and(|factory| factory.has_tables);
        let unusable = |e: correct::Error| Error::Document(e.to_string());
        let mut called = Vec::new();
        for finding in &self.findings {
            let Some(correction) = &finding.correction else { continue };
            let code: Code = finding.code.parse().map_err(|e| Error::Document(format!("{e}")))?;
            let number = |name: &str| {
                correction.parameters.get(name).copied().ok_or_else(|| {
                    Error::Document(format!("{code}: its correction lacks `{name}`"))
                })
            };
            let steps = match correction.kind.as_str() {
                "focal" => vec![Step::Focal { focal_px: number("focal_px")? }],
                "principal_point" => vec![Step::Center {
                    center_px: [number("center_x_px")?, number("center_y_px")?],
                }],
                "undistort" => {
                    vec![Step::undistort(has_tables, camera.as_ref()).map_err(unusable)?]
                }
                "depth" => {
                    vec![Step::Depth { scale: number("scale")?, bias_m: number("bias_mm")? / 1e3 }]
                }
                "align" => vec![
                    Step::DepthZoom { zoom: [number("zoom")?; 2] },
                    Step::DepthShift { shift_px: [number("shift_x_px")?, number("shift_y_px")?] },
                ],
                "unmirror" => vec![Step::Unmirror(Mirrored::Both)],
                "unmirror_depth" => vec![Step::Unmirror(Mirrored::Depth)],
                "scale_intrinsics" => vec![Step::ScaleIntrinsics {
                    factor: [number("factor_x")?, number("factor_y")?],
                }],
                other => {
                    return Err(Error::Document(format!(
                        "{code}: no correction is called `{other}`"
                    )));
                }
            };
            // Before version 0.2 only faults named a correction.
            let is_fault = finding.severity == Verdict::Fault.name();
            let verdict = if is_fault { Verdict::Fault } else { Verdict::Info };
            called.push(Called { code, verdict, steps });
        }
        let state = self.distortion_state == DistortionState::RectifiedTwice.name();
        let state = if state { DistortionState::RectifiedTwice } else { DistortionState::Unknown };
        Plan::called_for(called, state, which, sampling).map_err(unusable)
    }
}
