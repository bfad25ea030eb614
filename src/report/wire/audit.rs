//! An audit.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{Calibration, finite};
use crate::{
    audit,
    board::{CharucoBoard, Layout},
    calibrate::Estimate,
    depth::{BoardDepth, FrameDepth, NoiseAtRange, Pattern},
    diagnose::{Device, Finding},
    measure::FrameMeasurement,
    recording::{Defect, Factory},
};

/// Everything that can be known of a recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Audit {
    /// Name of the recording.
    pub recording: String,
    /// Version of truedepth.
    pub version: String,
    /// The camera.
    pub device: DeviceInfo,
    /// The board that was looked for.
    pub board: Board,
    /// Frames in the recording.
    pub n_frames: usize,
    /// Frames in which the board was seen.
    pub n_frames_with_board: usize,
    /// Those that are used: of more than 240 the ones whose views differ most.
    pub n_frames_used: usize,
    /// What was odd in the files, in words.
    pub problems: Vec<String>,
    /// The own intrinsics; `null` where there are none.
    pub calibration: Option<Calibration>,
    /// Why there are none.
    pub no_calibration: Option<String>,
    /// Sensor against board; `null` where it could not be compared.
    pub depth: Option<Depth>,
    /// Depth against colour.
    pub alignment: Alignment,
    /// `rectified`, `distorted`, `rectified_twice` or `unknown`.
    pub distortion_state: String,
    /// The same of the depth maps.
    #[serde(default)]
    pub depth_distortion_state: String,
    /// By code.
    pub findings: Vec<FindingInfo>,
    /// In order of time.
    pub frames: Vec<Frame>,
}

/// The camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DeviceInfo {
    /// `TrueDepth`, `LiDAR` or `unknown`.
    pub sensor: String,
    /// As in the files, e.g. `AVCaptureDeviceTypeBuiltInTrueDepthCamera`.
    pub device_type: Option<String>,
    /// Devices known to have this camera, for people.
    pub model: Option<String>,
    /// The factory's calibration at the size of the images.
    pub factory: Option<FactoryInfo>,
}

/// The factory's calibration at the size of the images.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FactoryInfo {
    /// The mean of both focal lengths.
    pub focal_px: f64,
    /// Principal point.
    pub principal_point_px: [f64; 2],
    /// Columns and rows these numbers are for.
    pub image_size_px: [usize; 2],
    /// `intrinsicMatrixReferenceDimensions`.
    pub reference_dimensions_px: Option<[f64; 2]>,
    /// Lens distortion centre.
    pub distortion_center_px: Option<[f64; 2]>,
    /// Whether both distortion tables are there.
    pub has_tables: bool,
    /// `GeometricDistortionCorrectionEnabled`.
    pub geometric_distortion_correction: Option<bool>,
    /// `isDepthDataFiltered`.
    pub depth_filtered: Option<bool>,
    /// `depthDataAccuracy` is absolute.
    pub depth_absolute: Option<bool>,
}

/// The board that was looked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Board {
    /// Squares along a row.
    pub squares_x: usize,
    /// Squares along a column.
    pub squares_y: usize,
    /// Side of a square.
    pub square_m: f64,
    /// Side of a marker.
    pub marker_m: f64,
    /// As OpenCV names it, without `DICT_`.
    pub dictionary: String,
    /// `legacy` or `new`, where it was given or seen.
    pub layout: Option<String>,
}

/// Sensor against board. Errors are board depth minus sensor depth, as in the paper's code.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Depth {
    /// Mean over frames of the median error, poses by the factory's intrinsics.
    pub factory_median_error_mm: Option<f64>,
    /// Spread of the frames' medians over the root of their number.
    pub factory_median_error_sigma_mm: Option<f64>,
    /// As `factory_median_error_mm`, poses by the own camera.
    pub own_median_error_mm: Option<f64>,
    /// Spread of the frames' medians over the root of their number.
    pub own_median_error_sigma_mm: Option<f64>,
    /// sensor = scale · board + bias, from the board's whole surface, poses by the own camera; `null` without one.
    pub scale: Option<f64>,
    /// Standard deviation of `scale`.
    pub scale_sigma: Option<f64>,
    /// Where the line meets board = 0.
    pub bias_mm: Option<f64>,
    /// Standard deviation of `bias_mm`.
    pub bias_sigma_mm: Option<f64>,
    /// Correlation of scale and bias.
    pub scale_bias_correlation: Option<f64>,
    /// Smallest and largest depth of the board.
    pub range_mm: Option<[f64; 2]>,
    /// What is left when scale, bias and alignment are taken out.
    pub noise: Option<DepthNoise>,
    /// What comes and goes at a pixel between successive frames in which nothing moved, by distance; empty where there
    /// are no such frames.
    #[serde(default)]
    pub temporal_noise: Vec<TemporalNoiseInfo>,
    /// Pairs of successive frames with depth and board in both, and those in which the board stood still.
    #[serde(default)]
    pub successive_pairs: [usize; 2],
    /// Where in the image it is left.
    pub residual_map: Option<ResidualMap>,
    /// Frames with depth and board.
    pub per_frame: Vec<FrameDepthInfo>,
}

/// Noise of single pixels between frames, at some distance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TemporalNoiseInfo {
    /// Median distance of the pixels.
    pub distance_mm: Option<f64>,
    /// Standard deviation of a pixel between frames.
    pub noise_mm: Option<f64>,
    /// How sure that is.
    pub noise_sigma_mm: Option<f64>,
    /// Standard deviation of a pixel about small planes within one of these frames.
    pub one_frame_mm: Option<f64>,
    /// Pairs of frames.
    pub n_pairs: usize,
    /// Pixels compared, over all pairs.
    pub n_pixels: usize,
}

impl From<&NoiseAtRange> for TemporalNoiseInfo {
    fn from(at: &NoiseAtRange) -> Self {
        Self {
            distance_mm: finite(1e3 * at.depth_m),
            noise_mm: finite(1e3 * at.noise_m.value),
            noise_sigma_mm: finite(1e3 * at.noise_m.sigma),
            one_frame_mm: finite(1e3 * at.one_frame_m),
            n_pairs: at.n_pairs,
            n_pixels: at.n_pixels,
        }
    }
}

/// Noise and holes of the depth maps on the board.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DepthNoise {
    /// Standard deviation of single pixels about small planes.
    pub pixel_mm: Option<f64>,
    /// Standard deviation from frame to frame at one place of the image: slow noise and errors of the poses.
    pub frame_mm: Option<f64>,
    /// RMS over the image of what stays the same in all frames.
    pub fixed_mm: Option<f64>,
    /// Share of the pixels on the board without measurement.
    pub hole_share: Option<f64>,
    /// The same where the board is 0.2 m away or more and seen under 60 degrees at most.
    pub hole_share_in_reach: Option<f64>,
}

/// Sensor minus model over the image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ResidualMap {
    /// Side of a cell.
    pub cell_px: usize,
    /// Cells along a row.
    pub columns: usize,
    /// Median of each cell, row by row; `null` where no frame showed the board.
    pub median_mm: Vec<Option<f64>>,
    /// Frames that showed the board there.
    pub n_frames: Vec<usize>,
}

/// One frame's depth against the board.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameDepthInfo {
    /// Index of the frame in the recording.
    pub frame: usize,
    /// With the factory's intrinsics (with the own camera where the factory says nothing).
    pub median_error_mm: Option<f64>,
    /// With the own camera.
    pub own_median_error_mm: Option<f64>,
    /// Corners that `median_error_mm` is the median of.
    pub n: usize,
}

/// Depth against colour; `null` is "not measured".
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Alignment {
    /// Width of the window of the colour image that the depth map shows over the width of the image, about the
    /// principal point: 1 where they are aligned.
    pub zoom: Option<f64>,
    /// Standard deviation of `zoom`.
    pub zoom_sigma: Option<f64>,
    /// How far depth lies right of and below its place in the colour image.
    pub shift_px: Option<[f64; 2]>,
    /// Standard deviations of `shift_px`.
    pub shift_sigma_px: Option<[f64; 2]>,
    /// By the slopes of tilted views alone.
    pub slopes: Option<Witness>,
    /// By the print that the depth maps show faintly, alone; `null` where it does not stand out.
    pub print: Option<PrintWitness>,
    /// How far these two lie apart: chi-squared over its 3 degrees of freedom; beyond 1 the σ above are larger for it.
    pub disagreement: Option<f64>,
    /// Whether the depth maps are distorted as the colour images are, as a share: 0 where they are, 1 where one is
    /// distorted and the other is not; `null` where no tables and no camera tell what that would look like.
    #[serde(default)]
    pub lens_share: Option<f64>,
    /// Standard deviation of `lens_share`.
    #[serde(default)]
    pub lens_share_sigma: Option<f64>,
    /// Whether the images show the board mirrored.
    pub mirrored: Option<bool>,
    /// Whether the depth maps are mirrored against the colour images.
    pub depth_mirrored: Option<bool>,
}

/// One way to tell where depth lies on colour.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Witness {
    /// As in [`Alignment`].
    pub zoom: f64,
    /// Its standard deviation.
    pub zoom_sigma: f64,
    /// As in [`Alignment`].
    pub shift_px: [f64; 2],
    /// Their standard deviations.
    pub shift_sigma_px: [f64; 2],
}

/// The print as a witness.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PrintWitness {
    /// Where it lies.
    #[serde(flatten)]
    pub place: Witness,
    /// How much nearer white is measured than black.
    pub contrast_mm: f64,
    /// Its standard deviation.
    pub contrast_sigma_mm: f64,
}

/// One thing that was checked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FindingInfo {
    /// `TD201` and the like.
    pub code: String,
    /// `fault`, `warning`, `info`, `ok` or `unknown`.
    pub severity: String,
    /// A few words.
    pub title: String,
    /// The deviation, in `unit`.
    pub value: Option<f64>,
    /// Its standard deviation.
    pub sigma: Option<f64>,
    /// `%`, `px`, `mm`, `deg` or empty.
    pub unit: String,
    /// Beyond this a significant deviation is a fault.
    pub tolerance: Option<f64>,
    /// One sentence with the numbers and the test.
    pub summary: String,
    /// What to do now.
    pub what_to_do: String,
    /// What is wrong, where it could be removed.
    pub defect: Option<Defect>,
    /// The numbers behind it, by name.
    pub evidence: BTreeMap<String, EvidenceInfo>,
}

/// A number that speaks for a verdict.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EvidenceInfo {
    /// The number; its name tells the unit.
    pub value: Option<f64>,
    /// Its standard deviation, where it is an estimate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma: Option<f64>,
}

/// One frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Index in the recording.
    pub frame: usize,
    /// What people call it: in the capture app's recordings the timestamp, milliseconds.
    pub id: String,
    /// Since the first frame.
    pub t_ns: i64,
    /// Name of the colour image inside the recording.
    pub color: Option<String>,
    /// Name of the depth image inside the recording.
    pub depth: Option<String>,
    /// Corners found.
    pub n_corners: usize,
    /// Candidates not taken.
    pub n_rejected: usize,
    /// Of the pose with the factory's intrinsics, the board taken for flat.
    pub factory_rms_px: Option<f64>,
    /// Of the pose with the own camera: against the board's shape in frames that a calibration used which found one,
    /// else against a flat board.
    pub own_rms_px: Option<f64>,
    /// Fraction of the depth map without measurement.
    pub holes: Option<f64>,
}

impl From<&audit::Audit> for Audit {
    fn from(audit: &audit::Audit) -> Self {
        let factory = audit.factory.as_ref();
        Self {
            recording: audit.name.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            device: DeviceInfo::new(&audit.device, factory),
            board: Board::new(&audit.board, audit.layout),
            n_frames: audit.frames.len(),
            n_frames_with_board: audit.n_frames_with_board(),
            n_frames_used: audit.n_frames_with_board() - audit.n_frames_summarised(),
            problems: audit.problems.iter().map(ToString::to_string).collect(),
            calibration: audit.calibration.as_ref().map(|calibration| {
                Calibration::new(&audit.name, audit.method.name(), factory, calibration)
            }),
            no_calibration: audit.no_calibration.clone(),
            depth: Depth::new(audit),
            alignment: Alignment::new(audit),
            distortion_state: audit.distortion_state.name().to_owned(),
            depth_distortion_state: audit.depth_distortion_state.name().to_owned(),
            findings: audit.findings.iter().map(FindingInfo::from).collect(),
            frames: audit.frames.iter().enumerate().map(Frame::from).collect(),
        }
    }
}

impl Alignment {
    fn new(audit: &audit::Audit) -> Self {
        let found = audit.registration.as_ref();
        let shift = |of: fn(&Estimate) -> f64| {
            let [x, y] = found?.shift_px.each_ref().map(of);
            finite(x).zip(finite(y)).map(|(x, y)| [x, y])
        };
        let handedness = audit.handedness.filter(|h| h.n_straight + h.n_mirrored > 0);
        Self {
            zoom: found.and_then(|r| finite(r.zoom.value)),
            zoom_sigma: found.and_then(|r| finite(r.zoom.sigma)),
            shift_px: shift(|e| e.value),
            shift_sigma_px: shift(|e| e.sigma),
            slopes: found.map(|r| Witness::new(r.slopes.zoom, r.slopes.shift_px)),
            print: found.and_then(|r| r.imprint.as_ref()).map(|imprint| PrintWitness {
                place: Witness::new(imprint.zoom, imprint.shift_px),
                contrast_mm: 1e3 * imprint.contrast_m.value,
                contrast_sigma_mm: 1e3 * imprint.contrast_m.sigma,
            }),
            disagreement: found.and_then(|r| r.disagreement),
            lens_share: found.and_then(|r| finite(r.lens_share?.value)),
            lens_share_sigma: found.and_then(|r| finite(r.lens_share?.sigma)),
            mirrored: mirrored(&audit.frames),
            depth_mirrored: handedness.map(|h| h.n_mirrored > h.n_straight),
        }
    }
}

impl Witness {
    fn new(zoom: Estimate, shift_px: [Estimate; 2]) -> Self {
        Self {
            zoom: zoom.value,
            zoom_sigma: zoom.sigma,
            shift_px: shift_px.map(|e| e.value),
            shift_sigma_px: shift_px.map(|e| e.sigma),
        }
    }
}

/// What most views of the board say.
fn mirrored(frames: &[FrameMeasurement]) -> Option<bool> {
    let seen: Vec<bool> = frames
        .iter()
        .filter_map(|f| f.observation.identity.as_ref())
        .map(|identity| identity.mirrored)
        .collect();
    let n_mirrored = seen.iter().filter(|&&mirrored| mirrored).count();
    (!seen.is_empty()).then_some(2 * n_mirrored > seen.len())
}

impl DeviceInfo {
    pub(super) fn new(device: &Device, factory: Option<&Factory>) -> Self {
        Self {
            sensor: device.sensor.name().to_owned(),
            device_type: device.device_type.clone(),
            model: device.model.map(str::to_owned),
            factory: factory.map(FactoryInfo::from),
        }
    }
}

impl From<&Factory> for FactoryInfo {
    fn from(factory: &Factory) -> Self {
        let intrinsics = &factory.intrinsics;
        Self {
            focal_px: intrinsics.focal_px(),
            principal_point_px: [intrinsics.cx, intrinsics.cy],
            image_size_px: [intrinsics.width, intrinsics.height],
            reference_dimensions_px: factory.reference_dimensions,
            distortion_center_px: factory.distortion_center.map(|center| [center.x, center.y]),
            has_tables: factory.tables.is_some(),
            geometric_distortion_correction: factory.geometric_distortion_correction,
            depth_filtered: factory.depth_filtered,
            depth_absolute: factory.depth_absolute,
        }
    }
}

impl Board {
    fn new(board: &CharucoBoard, seen: Option<Layout>) -> Self {
        Self {
            squares_x: board.squares_x,
            squares_y: board.squares_y,
            square_m: board.square_m,
            marker_m: board.marker_m,
            dictionary: board.dictionary.name().to_owned(),
            layout: seen.or(board.layout).map(|layout| layout.name().to_owned()),
        }
    }
}

impl Depth {
    fn new(audit: &audit::Audit) -> Option<Self> {
        let (factory, own) = (audit.factory_depth.as_ref(), audit.own_depth.as_ref());
        let frames = &factory.or(own)?.frames;
        let error = |depth: Option<&BoardDepth>| depth.and_then(|depth| depth.mean_of_medians_m);
        let value_mm = |estimate: Option<Estimate>| estimate.and_then(|e| finite(1e3 * e.value));
        let sigma_mm = |estimate: Option<Estimate>| estimate.and_then(|e| finite(1e3 * e.sigma));
        let found = audit.registration.as_ref();
        Some(Self {
            factory_median_error_mm: value_mm(error(factory)),
            factory_median_error_sigma_mm: sigma_mm(error(factory)),
            own_median_error_mm: value_mm(error(own)),
            own_median_error_sigma_mm: sigma_mm(error(own)),
            scale: found.and_then(|r| finite(r.scale.value)),
            scale_sigma: found.and_then(|r| finite(r.scale.sigma)),
            bias_mm: value_mm(found.map(|r| r.bias_m)),
            bias_sigma_mm: sigma_mm(found.map(|r| r.bias_m)),
            scale_bias_correlation: found.and_then(|r| finite(r.scale_bias_correlation())),
            range_mm: found.map(|r| r.range_m.map(|depth_m| 1e3 * depth_m)),
            noise: found.map(|r| DepthNoise::from(&r.pattern)),
            temporal_noise: audit.temporal_noise.by_range.iter().map(Into::into).collect(),
            successive_pairs: [audit.temporal_noise.n_successive, audit.temporal_noise.n_still],
            residual_map: found.map(|r| ResidualMap::from(&r.pattern)),
            per_frame: frames.iter().map(|frame| FrameDepthInfo::new(frame, own)).collect(),
        })
    }
}

impl From<&Pattern> for DepthNoise {
    fn from(pattern: &Pattern) -> Self {
        let holes = &pattern.holes;
        Self {
            pixel_mm: finite(1e3 * pattern.pixel_noise_m),
            frame_mm: finite(1e3 * pattern.frame_noise_m),
            fixed_mm: finite(1e3 * pattern.fixed_m),
            hole_share: finite(holes.n_holes as f64 / holes.n_pixels as f64),
            hole_share_in_reach: holes.share_in_reach(),
        }
    }
}

impl From<&Pattern> for ResidualMap {
    fn from(pattern: &Pattern) -> Self {
        let cells = &pattern.cells;
        Self {
            cell_px: pattern.cell_px,
            columns: pattern.columns,
            median_mm: cells.iter().map(|cell| finite(1e3 * cell.median_m)).collect(),
            n_frames: cells.iter().map(|cell| cell.n_frames).collect(),
        }
    }
}

impl FrameDepthInfo {
    fn new(frame: &FrameDepth, own: Option<&BoardDepth>) -> Self {
        let mm =
            |frame: &FrameDepth| frame.median_error_m.and_then(|error_m| finite(1e3 * error_m));
        let own = own.and_then(|own| own.frames.iter().find(|other| other.frame == frame.frame));
        Self {
            frame: frame.frame,
            median_error_mm: mm(frame),
            own_median_error_mm: own.and_then(mm),
            n: frame.kept().count(),
        }
    }
}

impl From<&Finding> for FindingInfo {
    fn from(finding: &Finding) -> Self {
        Self {
            code: finding.code.name().to_owned(),
            severity: finding.verdict.name().to_owned(),
            title: finding.title().to_owned(),
            value: finding.value.and_then(finite),
            sigma: finding.sigma.and_then(finite),
            unit: finding.unit.symbol().to_owned(),
            tolerance: finding.tolerance.and_then(finite),
            summary: finding.summary.clone(),
            what_to_do: finding.what_to_do.clone(),
            defect: finding.defect,
            evidence: finding
                .evidence
                .iter()
                .map(|e| {
                    (
                        e.name.to_owned(),
                        EvidenceInfo { value: finite(e.value), sigma: e.sigma.and_then(finite) },
                    )
                })
                .collect(),
        }
    }
}

impl From<(usize, &FrameMeasurement)> for Frame {
    fn from((index, frame): (usize, &FrameMeasurement)) -> Self {
        Self {
            frame: index,
            id: frame.id.clone(),
            t_ns: frame.t_ns,
            color: frame.color.clone(),
            depth: frame.depth.clone(),
            n_corners: frame.n_corners,
            n_rejected: frame.observation.rejects.len(),
            factory_rms_px: frame.factory_view.as_ref().and_then(|view| finite(view.rms_px)),
            own_rms_px: frame.own_view.as_ref().and_then(|view| finite(view.rms_px)),
            holes: frame.holes.and_then(finite),
        }
    }
}
