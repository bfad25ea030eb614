//! What metadata alone tell: of one recording, of two, and of the registry.

use serde::Serialize;

use super::{DeviceInfo, Document};
use crate::{
    diagnose::{self, AcrossApis, Finding, Inspection, KnownIssue, Side},
    recording::Recording,
};

/// What the metadata of a recording tell: what `truedepth inspect --json` prints.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Inspect {
    /// Name of the recording.
    pub recording: String,
    /// The camera.
    pub device: DeviceInfo,
    /// Which known device it is; `null` where the metadata have no reference dimensions.
    pub identity: Option<IdentityInfo>,
    /// The factory's parameters at the reference dimensions.
    pub sheet: Option<SheetInfo>,
    /// Frames in the recording.
    pub n_frames: usize,
    /// What was odd in the files, in words.
    pub problems: Vec<String>,
    /// By code.
    pub findings: Vec<Finding>,
}

/// Which known device it is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IdentityInfo {
    /// `unknown`, `sensor_only`, `camera` or `unit`.
    pub certainty: String,
    /// Names of the registry's rows that match, nearest first.
    pub matches: Vec<String>,
    /// As they are sold, each once.
    pub products: Vec<String>,
    /// Focal length over the nearest row's, minus one.
    pub focal_difference_percent: Option<f64>,
    /// `depth-zoom`, `focal-length`, `not-rectified`.
    pub known_issues: Vec<String>,
}

/// Factory parameters at the reference dimensions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SheetInfo {
    /// `intrinsicMatrixReferenceDimensions`.
    pub reference_dimensions_px: [f64; 2],
    /// Depth focal length.
    pub focal_px: f64,
    /// Depth principal point.
    pub principal_point_px: [f64; 2],
    /// Lens distortion centre.
    pub distortion_center_px: Option<[f64; 2]>,
    /// The paper's "LDC equals PP".
    pub distortion_center_equals_principal_point: Option<bool>,
    /// Their distance.
    pub center_distance_px: Option<f64>,
    /// The focal length at an image of 640 columns.
    pub focal_at_640_px: f64,
    /// Colour focal length at the size of the colour image.
    pub color_focal_px: Option<f64>,
    /// Colour principal point at the size of the colour image.
    pub color_principal_point_px: Option<[f64; 2]>,
}

/// Two sets of factory parameters: what `truedepth compare --json` prints.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Compare {
    /// One per pair: one for two given sides, ten for all of the paper.
    pub pairs: Vec<PairInfo>,
}

/// One pair.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PairInfo {
    /// AVFoundation's, or the first.
    pub first: SideInfo,
    /// ARKit's, or the second.
    pub second: SideInfo,
    /// Second over first, minus one.
    pub focal_difference_percent: f64,
    /// Second over first, minus one; width and height.
    pub reference_difference_percent: [f64; 2],
    /// `depth-zoom`, `focal-length` or `null`; `null`, too, for two sides of one API.
    pub issue: Option<String>,
    /// Both corrections of the paper; `null` for two sides of one API.
    pub corrections: Option<PairCorrections>,
    /// TD205 or TD502.
    pub findings: Vec<Finding>,
}

/// One side of a pair.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SideInfo {
    /// Name in the registry, or of the recording or file.
    pub name: String,
    /// `av`, `ar` or `null` where it is not known.
    pub api: Option<String>,
    /// Its parameters.
    pub sheet: SheetInfo,
}

/// The paper's corrections; each is meant for its own issue only.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PairCorrections {
    /// Issue 1: for ARKit's depth maps, about the principal point; horizontally and vertically.
    pub depth_zoom: [f64; 2],
    /// Issue 2, at the reference dimensions.
    pub av_focal_px: f64,
    /// Issue 2, at an image of 640 columns.
    pub av_focal_at_640_px: f64,
    /// Issue 2, at the reference dimensions.
    pub ar_focal_px: f64,
    /// Issue 2, at an image of 640 columns.
    pub ar_focal_at_640_px: f64,
}

impl Document for Inspect {
    const SCHEMA: &'static str = "truedepth.inspect/1";
}

impl Document for Compare {
    const SCHEMA: &'static str = "truedepth.compare/1";
}

impl Inspect {
    /// What was found of a recording.
    pub fn new(recording: &Recording, inspection: &Inspection<'_>) -> Self {
        Self {
            recording: recording.name.clone(),
            device: DeviceInfo::new(&inspection.device, recording.factory()),
            identity: inspection.identity.as_ref().map(IdentityInfo::from),
            sheet: inspection.sheet.as_ref().map(SheetInfo::from),
            n_frames: recording.frames.len(),
            problems: recording.problems.iter().map(ToString::to_string).collect(),
            findings: inspection.findings.clone(),
        }
    }
}

impl From<&diagnose::Identity<'_>> for IdentityInfo {
    fn from(identity: &diagnose::Identity<'_>) -> Self {
        let mut products: Vec<String> = Vec::new();
        for entry in &identity.matches {
            if !products.contains(&entry.product) {
                products.push(entry.product.clone());
            }
        }
        Self {
            certainty: identity.certainty.name().to_owned(),
            matches: identity.matches.iter().map(|entry| entry.name()).collect(),
            products,
            focal_difference_percent: identity.focal_difference.map(|d| 100.0 * d),
            known_issues: identity.issues.iter().map(|issue| issue.name().to_owned()).collect(),
        }
    }
}

impl From<&diagnose::Sheet> for SheetInfo {
    fn from(sheet: &diagnose::Sheet) -> Self {
        Self {
            reference_dimensions_px: sheet.reference,
            focal_px: sheet.focal_px,
            principal_point_px: sheet.center,
            distortion_center_px: sheet.distortion_center,
            distortion_center_equals_principal_point: sheet.centers_equal(),
            center_distance_px: sheet.center_distance_px(),
            focal_at_640_px: sheet.focal_at_px(640.0),
            color_focal_px: sheet.color_focal_px,
            color_principal_point_px: sheet.color_center,
        }
    }
}

impl From<&Side> for SideInfo {
    fn from(side: &Side) -> Self {
        Self {
            name: side.name.clone(),
            api: side.api.map(|api| api.name().to_owned()),
            sheet: SheetInfo::from(&side.sheet),
        }
    }
}

impl Compare {
    /// These pairs.
    pub fn new(pairs: &[diagnose::Comparison]) -> Self {
        Self { pairs: pairs.iter().map(PairInfo::from).collect() }
    }
}

impl From<&diagnose::Comparison> for PairInfo {
    fn from(pair: &diagnose::Comparison) -> Self {
        let (a, b) = (&pair.first.sheet, &pair.second.sheet);
        let corrections = pair.across.as_ref().map(|across: &AcrossApis| PairCorrections {
            depth_zoom: across.depth_zoom,
            av_focal_px: across.av_corrected_px,
            av_focal_at_640_px: across.av_corrected_px * 640.0 / a.reference[0],
            ar_focal_px: across.ar_corrected_px,
            ar_focal_at_640_px: across.ar_corrected_px * 640.0 / b.reference[0],
        });
        let issue = pair.across.and_then(|across| across.issue);
        Self {
            first: SideInfo::from(&pair.first),
            second: SideInfo::from(&pair.second),
            focal_difference_percent: 100.0 * (b.focal_px / a.focal_px - 1.0),
            reference_difference_percent: [0, 1]
                .map(|i| 100.0 * (b.reference[i] / a.reference[i] - 1.0)),
            issue: issue.map(|issue: KnownIssue| issue.name().to_owned()),
            corrections,
            findings: pair.findings.clone(),
        }
    }
}
