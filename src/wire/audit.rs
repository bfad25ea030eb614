//! An audit.

use serde::{Deserialize, Serialize};

use super::{
    Detail, Document, Error,
    calibration::{Calibration, Known, View},
};
use crate::{
    audit,
    board::{CharucoBoard, Layout},
    calibrate::Estimate,
    correct::{Plan, Selection},
    depth::{BoardDepth, FrameDepth, Registration, Sample, TemporalNoise},
    detect::Observation,
    diagnose::{Device, Finding},
    recording::{Factory, StreamState},
};

/// Everything that can be known of a recording: what `truedepth audit --json` prints and `report.json` holds.
#[derive(Debug, Serialize)]
pub struct Audit<'a> {
    /// Name of the recording.
    recording: &'a str,
    device: DeviceInfo,
    board: Board,
    n_frames: usize,
    /// Frames in which the board was seen.
    n_frames_with_board: usize,
    /// Those that are used: of more than 240 the ones whose views differ most.
    n_frames_used: usize,
    /// What was odd in the files, in words.
    problems: Vec<String>,
    /// The own intrinsics; `null` where there are none.
    calibration: Option<Calibration<'a>>,
    /// Why there are none.
    no_calibration: Option<&'a str>,
    /// Sensor against board; `null` where it could not be compared.
    depth: Option<Depth<'a>>,
    /// Whether the images show the board mirrored.
    mirrored: Option<bool>,
    /// Whether the depth maps are mirrored against the colour images.
    depth_mirrored: Option<bool>,
    distortion_state: StreamState,
    /// The same of the depth maps.
    depth_distortion_state: StreamState,
    /// By code.
    findings: &'a [Finding],
    /// In order of time.
    frames: Vec<Frame<'a>>,
}

/// What is read back of an audit.
#[derive(Clone, Debug, Deserialize)]
pub struct KnownAudit {
    device: KnownDevice,
    /// The own intrinsics; `null` where there are none.
    pub calibration: Option<Known>,
    /// By code.
    pub findings: Vec<Finding>,
}

#[derive(Clone, Debug, Deserialize)]
struct KnownDevice {
    factory: Option<KnownFactory>,
}

#[derive(Clone, Debug, Deserialize)]
struct KnownFactory {
    has_tables: bool,
}

impl KnownAudit {
    /// What removes what this audit has found.
    ///
    /// Errors: a camera that cannot be, a fault that names no way back.
    pub fn plan(&self, selection: Selection<'_>) -> Result<Plan, Error> {
        let has_tables = self.device.factory.as_ref().is_some_and(|factory| factory.has_tables);
        let own = self.calibration.as_ref().filter(|_| !has_tables);
        let camera = own.map(Known::camera).transpose()?;
        Ok(Plan::of_findings(&self.findings, camera.as_ref(), selection)?)
    }
}

/// The camera.
#[derive(Clone, Debug, PartialEq, Serialize)]
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
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
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
#[derive(Clone, Debug, PartialEq, Serialize)]
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
#[derive(Debug, Serialize)]
struct Depth<'a> {
    /// Mean over frames of the median error, poses by the factory's intrinsics.
    factory_median_error_m: Option<Estimate>,
    /// The same, poses by the own camera.
    own_median_error_m: Option<Estimate>,
    /// Scale, bias, zoom, shift and what they leave, from the board's whole surface, poses by the own camera; `null`
    /// without one.
    registration: Option<&'a Registration>,
    scale_bias_correlation: Option<f64>,
    /// Share of the pixels on the board without measurement.
    hole_share: Option<f64>,
    /// The same where the board is 0.2 m away or more and seen under 60 degrees at most.
    hole_share_in_reach: Option<f64>,
    /// What comes and goes at a pixel between successive frames in which nothing moved.
    temporal_noise: &'a TemporalNoise,
    /// Frames with depth and board.
    frames: Vec<FrameErrors>,
}

/// One frame's depth against the board.
#[derive(Debug, Serialize)]
struct FrameErrors {
    frame: usize,
    /// With the factory's intrinsics (with the own camera where the factory says nothing).
    median_error_m: Option<f64>,
    /// With the own camera.
    own_median_error_m: Option<f64>,
    /// Corners that `median_error_m` is the median of.
    n: usize,
}

/// One frame.
#[derive(Debug, Serialize)]
struct Frame<'a> {
    frame: usize,
    /// What people call it: in the capture app's recordings the timestamp, milliseconds.
    id: &'a str,
    /// Since the first frame.
    t_ns: i64,
    /// Name of the colour image inside the recording.
    color: Option<&'a str>,
    /// Name of the depth image inside the recording.
    depth: Option<&'a str>,
    n_corners: usize,
    /// Candidates not taken.
    n_rejected: usize,
    /// Of the pose with the factory's intrinsics, the board taken for flat.
    factory_rms_px: Option<f64>,
    /// Of the pose with the own camera: against the board's shape in frames that a calibration used which found one,
    /// else against a flat board.
    own_rms_px: Option<f64>,
    /// Fraction of the depth map without measurement.
    holes: Option<f64>,
    /// Only where it was asked for.
    #[serde(flatten)]
    detail: Option<FrameDetail<'a>>,
}

/// All that is known of one frame.
#[derive(Debug, Serialize)]
struct FrameDetail<'a> {
    /// What was seen of the board.
    observation: &'a Observation,
    /// Pose and residuals with the factory's intrinsics.
    factory_view: Option<View<'a>>,
    /// The same with the own camera.
    own_view: Option<View<'a>>,
    /// Depth of board and sensor at each corner, poses by the own camera, else by the factory's.
    depth_at_corners: &'a [Sample],
}

impl Document for Audit<'_> {
    const SCHEMA: &'static str = "truedepth.audit/1";
}

impl<'a> Audit<'a> {
    /// Of this audit.
    pub fn new(audit: &'a audit::Audit, detail: Detail) -> Self {
        let factory = audit.factory.as_ref();
        let (n_mirrored, n_seen) = audit.n_mirrored_of();
        let handedness = audit.handedness.filter(|h| h.n_straight + h.n_mirrored > 0);
        let calibration = audit.calibration.as_ref().map(|calibration| {
            // The views are among the frames.
            let method = audit.method.name();
            Calibration::new(&audit.name, method, factory, calibration, Detail::Summary)
        });
        Self {
            recording: &audit.name,
            device: DeviceInfo::new(&audit.device, factory),
            board: Board::new(&audit.board, audit.layout),
            n_frames: audit.frames.len(),
            n_frames_with_board: audit.n_frames_with_board(),
            n_frames_used: audit.n_frames_with_board() - audit.n_frames_summarised(),
            problems: audit.problems.iter().map(ToString::to_string).collect(),
            calibration,
            no_calibration: audit.no_calibration.as_deref(),
            depth: Depth::new(audit),
            mirrored: (n_seen > 0).then_some(2 * n_mirrored > n_seen),
            depth_mirrored: handedness.map(|h| h.n_mirrored > h.n_straight),
            distortion_state: audit.distortion_state,
            depth_distortion_state: audit.depth_distortion_state,
            findings: &audit.findings,
            frames: (0..audit.frames.len()).map(|i| Frame::new(audit, i, detail)).collect(),
        }
    }
}

impl<'a> Frame<'a> {
    fn new(audit: &'a audit::Audit, index: usize, detail: Detail) -> Self {
        let frame = &audit.frames[index];
        let depth = audit.own_depth.as_ref().or(audit.factory_depth.as_ref());
        let samples = depth.and_then(|d| d.frames.iter().find(|f| f.frame == index));
        let view = |view: &'a Option<_>| view.as_ref().map(|view| View::new(view, Detail::Frames));
        Self {
            frame: index,
            id: &frame.id,
            t_ns: frame.t_ns,
            color: frame.color.as_deref(),
            depth: frame.depth.as_deref(),
            n_corners: frame.n_corners,
            n_rejected: frame.observation.rejects.len(),
            factory_rms_px: frame.factory_view.as_ref().map(|view| view.rms_px),
            own_rms_px: frame.own_view.as_ref().map(|view| view.rms_px),
            holes: frame.holes,
            detail: (detail == Detail::Frames).then(|| FrameDetail {
                observation: &frame.observation,
                factory_view: view(&frame.factory_view),
                own_view: view(&frame.own_view),
                depth_at_corners: samples.map_or(&[], |f| &f.samples),
            }),
        }
    }
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

impl<'a> Depth<'a> {
    fn new(audit: &'a audit::Audit) -> Option<Self> {
        let (factory, own) = (audit.factory_depth.as_ref(), audit.own_depth.as_ref());
        let frames = &factory.or(own)?.frames;
        let error = |depth: Option<&BoardDepth>| depth.and_then(|depth| depth.mean_of_medians_m);
        let registration = audit.registration.as_ref();
        let holes = registration.map(|r| r.pattern.holes);
        let own_of = |frame: &FrameDepth| own?.frames.iter().find(|f| f.frame == frame.frame);
        Some(Self {
            factory_median_error_m: error(factory),
            own_median_error_m: error(own),
            registration,
            scale_bias_correlation: registration.map(Registration::scale_bias_correlation),
            hole_share: holes.map(|h| h.n_holes as f64 / h.n_pixels as f64),
            hole_share_in_reach: holes.and_then(|holes| holes.share_in_reach()),
            temporal_noise: &audit.temporal_noise,
            frames: frames
                .iter()
                .map(|frame| FrameErrors {
                    frame: frame.frame,
                    median_error_m: frame.median_error_m,
                    own_median_error_m: own_of(frame).and_then(|own| own.median_error_m),
                    n: frame.kept().count(),
                })
                .collect(),
        })
    }
}
