//! A small audit made by hand for the tests of what is made of one: an iPad whose factory focal length is 6.6 % too
//! long, seen in twelve frames. All randomness is a fixed sequence.

use std::sync::Arc;

use crate::{
    audit::Audit,
    board::{CharucoBoard, Layout},
    calibrate::{
        self, BoardSurface, Calibration, Candidate, DistortionTest, Estimate, FrameCorners,
        Hypothesis, Lens, Model, Outlier, Parameter, RejectedFrame, Rejection, SurfaceKind,
    },
    camera::{Camera, Distortion, Intrinsics},
    depth::{
        Holes, NoiseAtRange, Pattern, PatternCell, Registration, Slopes, TemporalNoise,
        against_board, patches,
    },
    detect::{Corner, Identity, Observation, Reason, Reject},
    diagnose::{Code, Device, Evidence, Finding, Quantity, Sensor, ToRecord, Tolerances, Verdict},
    files::{Limits, Memory},
    geom::{Board, Color, Pixel, Pose, Rotation, Vector3},
    image::{DepthMap, Rgb},
    math,
    measure::{FrameMeasurement, Measurements, Method},
    pose::View,
    recording::{Defect, Factory, Problem, Recording, StreamState, Writer},
};

const N_FRAMES: usize = 12;
const FACTORY_FOCAL_PX: f64 = 565.12;
const OWN_FOCAL_PX: f64 = 530.04;

pub(crate) fn audit() -> Audit {
    let board: CharucoBoard = "10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL".parse().expect("a board");
    let frames: Vec<FrameMeasurement> =
        (0..N_FRAMES).map(|frame| frame_audit(frame, &board)).collect();
    let depth = |view: fn(&FrameMeasurement) -> Option<&View>| {
        let views: Vec<(&View, &[Option<f64>])> =
            frames.iter().filter_map(|f| Some((view(f)?, f.sensor_m.as_slice()))).collect();
        against_board(&board, None, &views)
    };
    let mut factory = Factory::pinhole(intrinsics(FACTORY_FOCAL_PX));
    factory.reference_dimensions = Some([2016.0, 1512.0]);
    factory.distortion_center = Some(Pixel::new(320.55, 241.09));
    factory.geometric_distortion_correction = Some(true);
    factory.depth_filtered = Some(false);
    factory.depth_absolute = Some(true);
    factory.device_type = Some("AVCaptureDeviceTypeBuiltInTrueDepthCamera".to_owned());
    let calibration = calibration(&frames);
    let device = Device {
        sensor: Sensor::TrueDepth,
        device_type: factory.device_type.clone(),
        model: Some("iPad Pro 12.9\" (5th generation)"),
    };
    let measured = Measurements {
        name: "iPadPro12_5gen".to_owned(),
        method: Method::Auto,
        layout: Some(Layout::Legacy),
        problems: vec![Problem::MetadataWithoutImages { timestamps: vec![100_500, 101_000] }],
        factory: Some(factory),
        camera: Some(calibration.camera.clone()),
        given: None,
        no_calibration: None,
        factory_depth: Some(depth(|f| f.factory_view.as_ref())),
        own_depth: Some(depth(|f| f.own_view.as_ref())),
        registration: None,
        temporal_noise: TemporalNoise::default(),
        handedness: None,
        distortion: calibration.distortion.clone(),
        calibration: Some(calibration),
        frames,
        board,
    };
    Audit {
        measured,
        device,
        distortion_state: StreamState::Rectified,
        depth_distortion_state: StreamState::Rectified,
        findings: findings(),
    }
}

/// As [`audit`], with all that an audit can have: the board's shape, the motion of the poses, depth over the whole
/// board.
pub(crate) fn rich_audit() -> Audit {
    let mut audit = audit();
    let board = audit.board.clone();
    let input_frames: Vec<FrameCorners> = audit
        .frames
        .iter()
        .enumerate()
        .map(|(frame, f)| FrameCorners { frame, corners: f.observation.corners.clone() })
        .collect();
    let factory = intrinsics(FACTORY_FOCAL_PX);
    let input =
        calibrate::Input { board: &board, factory: &factory, tables: None, frames: &input_frames };
    let model = calibrate::Method::Robust(Model::FocalCentre);
    let motion = calibrate::calibrate(&input, model).expect("the sample is good enough").motion;
    for (index, frame) in audit.measured.frames.iter_mut().enumerate() {
        let depth_m = 0.24 + 0.015 * index as f32;
        let map = DepthMap::new(640, 480, vec![depth_m; 640 * 480]);
        frame.patches = patches(&map, &board, &frame.observation.corners);
    }
    let calibration = audit.measured.calibration.as_mut().expect("the sample has one");
    calibration.motion = motion;
    let heights_m = (0..board.n_corners()).map(|id| 4e-4 * wobble(id)).collect();
    calibration.surface = Some(BoardSurface {
        kind: SurfaceKind::Free,
        heights_m,
        sigmas_m: vec![2e-5; board.n_corners()],
        print: None,
    });
    let estimate = |value, sigma| Estimate { value, sigma };
    let cells = (0..16 * 12)
        .map(|cell| PatternCell {
            median_m: if cell < 8 { f64::NAN } else { 5e-4 * wobble(cell) },
            n_frames: 5,
            n_patches: 40,
        })
        .collect();
    let pattern = Pattern {
        cell_px: 40,
        columns: 16,
        cells,
        pixel_noise_m: 3e-4,
        frame_noise_m: 2e-4,
        fixed_m: 3e-4,
        holes: Holes::default(),
    };
    audit.measured.temporal_noise = TemporalNoise {
        by_range: vec![NoiseAtRange {
            depth_m: 0.2,
            noise_m: estimate(9e-5, 3e-6),
            one_frame_m: 2.6e-4,
            n_pairs: 4,
            n_pixels: 6000,
        }],
        n_successive: 4,
        n_still: 4,
    };
    audit.measured.registration = Some(Registration {
        scale: estimate(1.003, 0.009),
        bias_m: estimate(-5e-4, 1e-3),
        zoom: estimate(0.9507, 0.001),
        shift_px: [estimate(0.2, 0.3), estimate(-0.1, 0.3)],
        covariance: [[0.0; 5]; 5],
        center_m: 0.3,
        range_m: [0.2, 0.4],
        n_frames: 3,
        frames: vec![0, 1, 4],
        n_patches: 1200,
        slopes: Slopes {
            zoom: estimate(0.951, 0.002),
            shift_px: [estimate(0.4, 0.6), estimate(-0.2, 0.6)],
        },
        imprint: None,
        disagreement: None,
        lens_share: Some(estimate(0.04, 0.11)),
        pattern,
    });
    audit
}

/// A recording of one frame with the metadata of [`audit`].
pub(crate) fn recording() -> Recording {
    let audit = audit();
    let factory = audit.factory.as_ref().expect("the sample has metadata");
    let mut writer = Writer::new(Memory::new("iPadPro12_5gen"));
    let color = Rgb::new(640, 480, vec![[90; 3]; 640 * 480]);
    let depth = DepthMap::new(640, 480, vec![0.25; 640 * 480]);
    writer.frame(500, &color, &depth, factory).expect("memory takes everything");
    let memory = writer.finish().expect("as above");
    Recording::from_files(Arc::new(memory), &Limits::default()).expect("it was just written")
}

fn intrinsics(focal_px: f64) -> Intrinsics {
    Intrinsics { fx: focal_px, fy: focal_px, cx: 320.53, cy: 240.68, width: 640, height: 480 }
}

/// A fixed sequence between −1 and 1 with the mean 0.
fn wobble(i: usize) -> f64 {
    let x = (i as f64 * 0.754_877_666).fract() + (i as f64 * 0.569_840_291).fract();
    x - 1.0
}

fn frame_audit(frame: usize, board: &CharucoBoard) -> FrameMeasurement {
    let at = frame as f64;
    let own = Camera { intrinsics: intrinsics(OWN_FOCAL_PX), distortion: Distortion::None };
    let tilt = Vector3::new(0.32 * math::sin(1.7 * at), 0.35 * math::cos(2.3 * at), 0.05 * at);
    let rotation = Rotation::from_scaled_axis(tilt);
    let center = rotation * Vector3::new(0.104, 0.083, 0.0);
    let place =
        Vector3::new(0.02 * math::sin(0.9 * at), 0.015 * math::cos(1.3 * at), 0.24 + 0.015 * at);
    let color_from_board: Pose<Color, Board> = Pose::new(rotation, place - center);
    let mut corners = Vec::new();
    let mut residuals_px = Vec::new();
    let mut sensor_m = Vec::new();
    for id in (0..board.n_corners()).filter(|id| !(id * 7 + frame).is_multiple_of(17)) {
        let point = color_from_board * board.corner(id);
        let seed = 2 * (100 * frame + id);
        let residual = [0.12 * wobble(seed), 0.12 * wobble(seed + 1)];
        let Some(pixel) = own.project(point) else { continue };
        let pixel = Pixel::new(pixel.x + residual[0], pixel.y + residual[1]);
        if !(pixel.x > 2.0 && pixel.y > 2.0 && pixel.x < 637.0 && pixel.y < 477.0) {
            continue;
        }
        corners.push(Corner { id, pixel, sigma_px: 0.06 });
        residuals_px.push(residual);
        sensor_m.push(
            (!(id + frame).is_multiple_of(23))
                .then(|| point.z() - 0.0005 + 0.0012 * wobble(seed + 7)),
        );
    }
    let rms_px = (residuals_px.iter().map(|[x, y]| x * x + y * y).sum::<f64>()
        / residuals_px.len() as f64)
        .sqrt();
    let own_view = View { frame, corners: corners.clone(), color_from_board, residuals_px, rms_px };
    // With too long a focal length the board seems farther away by the same factor.
    let mut farther = color_from_board.translation;
    farther.z += center.z * (1.0 - FACTORY_FOCAL_PX / OWN_FOCAL_PX);
    farther.z *= FACTORY_FOCAL_PX / OWN_FOCAL_PX;
    let factory_view = View {
        color_from_board: Pose::new(rotation, farther),
        rms_px: 1.4 * rms_px + 0.1 * wobble(frame).abs(),
        ..own_view.clone()
    };
    let identity = Identity {
        layout: Layout::Legacy,
        mirrored: false,
        inverted: false,
        markers: (0..38).collect(),
        margin: 410.0,
    };
    let rejects =
        vec![Reject { pixel: Pixel::new(12.0 + 9.0 * at, 33.0), reason: Reason::NoCrossing }];
    FrameMeasurement {
        id: (100_000 + 500 * frame).to_string(),
        t_ns: 500_000_000 * frame as i64,
        color: Some(format!("rgb_{}.png", 100_000 + 500 * frame)),
        depth: Some(format!("depth_{}.png", 100_000 + 500 * frame)),
        factory: None,
        size_px: Some([640, 480]),
        depth_size_px: Some([640, 480]),
        n_corners: corners.len(),
        in_full: true,
        observation: Observation { corners, identity: Some(identity), rejects },
        sensor_m,
        patches: None,
        holes: Some(0.08),
        factory_view: Some(factory_view),
        own_view: Some(own_view),
    }
}

fn calibration(frames: &[FrameMeasurement]) -> Calibration {
    let estimate = |value, sigma| Estimate { value, sigma };
    let candidate = |model, rms_px, held_out_rms_px, focal_px| Candidate {
        model,
        rms_px,
        held_out_rms_px,
        held_out_sigma_px: 0.05 * held_out_rms_px,
        behind_best_sigmas: if model == Model::FocalCentre { 0.0 } else { 2.5 },
        focal_px,
    };
    let hypothesis = |lens, rms_px, focal_px| Hypothesis {
        lens,
        rms_px,
        flat_rms_px: rms_px,
        held_out_rms_px: 1.07 * rms_px,
        focal_px,
        center_px: [estimate(320.9, 0.6), estimate(240.3, 0.5)],
    };
    Calibration {
        method: calibrate::Method::Auto,
        model: Model::FocalCentre,
        camera: Camera { intrinsics: intrinsics(OWN_FOCAL_PX), distortion: Distortion::None },
        parameters: vec![
            Parameter { name: "focal_px", estimate: estimate(OWN_FOCAL_PX, 0.352) },
            Parameter { name: "center_x_px", estimate: estimate(320.53, 0.21) },
            Parameter { name: "center_y_px", estimate: estimate(240.68, 0.26) },
        ],
        covariance: vec![0.124, 0.01, -0.02, 0.01, 0.0441, 0.0, -0.02, 0.0, 0.0676],
        views: frames.iter().filter_map(|f| f.own_view.clone()).collect(),
        chosen: None,
        n_pictures: N_FRAMES,
        surface: None,
        surfaces: Vec::new(),
        left_out: Vec::new(),
        rolling_shutter: None,
        motion: None,
        distortion: Some(DistortionTest {
            amplitude: Some(estimate(0.01, 0.006)),
            k1: estimate(0.002, 0.001),
            k2: None,
            corner_shift_px: estimate(0.11, 0.07),
            table_corner_shift_px: Some(11.4),
            hypotheses: vec![
                hypothesis(Lens::None, 0.0964, estimate(OWN_FOCAL_PX, 0.352)),
                hypothesis(Lens::InverseTable, 0.484, estimate(536.2, 1.7)),
                hypothesis(Lens::ForwardTable, 0.512, estimate(523.9, 1.8)),
                hypothesis(Lens::FreeTable, 0.0963, estimate(530.1, 0.36)),
                hypothesis(Lens::FreeRadial, 0.0962, estimate(530.0, 0.37)),
            ],
        }),
        rejected: vec![RejectedFrame {
            frame: 9,
            reason: Rejection::NarrowCorners { n_corners: 7 },
        }],
        rms_px: 0.0964,
        candidates: vec![
            candidate(Model::Focal, 0.121, 0.128, estimate(530.9, 0.41)),
            candidate(Model::FocalTable, 0.484, 0.491, estimate(536.2, 1.7)),
            candidate(Model::FocalCentre, 0.0964, 0.1032, estimate(OWN_FOCAL_PX, 0.352)),
            candidate(Model::Brown, 0.0951, 0.1049, estimate(529.7, 0.48)),
        ],
        split_half_focal_px: Some([estimate(529.6, 0.52), estimate(530.4, 0.49)]),
        outliers: vec![Outlier { frame: 3, id: 61, residual_px: 2.31, residual_sigmas: 9.4 }],
    }
}

fn findings() -> Vec<Finding> {
    let base = |code, verdict| Finding { verdict, ..Finding::new(code, &Tolerances::default()) };
    vec![
        Finding {
            claim: "Two metadata entries have no image; no frame is lost by it.".to_owned(),
            value: Some(2.0),
            ..base(Code::TD101, Verdict::Info)
        },
        Finding {
            value: Some(-6.207),
            sigma: Some(0.062),
            claim: "The focal length is 530.0 ± 0.4 px, 6.2 % shorter than the factory's 565.12 px: 100 σ away, 1 % \
                      would count as true."
                .to_owned(),
            evidence: vec![
                Evidence::number("factory_focal_px", FACTORY_FOCAL_PX),
                Evidence { sigma: Some(0.352), ..Evidence::number("focal_px", OWN_FOCAL_PX) },
            ],
            what_to_do: "Use 530.04 px wherever the factory's focal length is used at 640x480.".to_owned(),
            defect: Some(Defect::Focal { ratio: FACTORY_FOCAL_PX / OWN_FOCAL_PX }),
            quantity: Some(Quantity {
                name: "Focal length".to_owned(),
                factory: "565.12 px".to_owned(),
                measured: "530.04 ± 0.35 px".to_owned(),
                difference: None,
            }),
            ..base(Code::TD201, Verdict::Fault)
        },
        Finding {
            value: Some(0.11),
            sigma: Some(0.07),
            claim: "Straight lines are straight to 0.11 ± 0.07 px at the corner of the image.".to_owned(),
            quantity: Some(Quantity {
                name: "Lens distortion in the images".to_owned(),
                factory: "—".to_owned(),
                measured: "rectified, depth too".to_owned(),
                difference: None,
            }),
            ..base(Code::TD203, Verdict::Ok)
        },
        Finding {
            value: Some(0.3),
            sigma: Some(0.9),
            claim: "The depth scale is 1.003 ± 0.009: a fault of 1 % could hide in the uncertainty.".to_owned(),
            what_to_do: "Record the board at 20, 30 and 40 cm, ten frames each.".to_owned(),
            quantity: Some(Quantity {
                name: "Depth scale".to_owned(),
                factory: "1".to_owned(),
                measured: "1.0030 ± 0.0090".to_owned(),
                difference: None,
            }),
            to_record: Some(ToRecord::Distances),
            ..base(Code::TD301, Verdict::Unknown)
        },
        Finding {
            claim: "The principal point and the distortion centre are not the same point, as on all cameras of \
                      this kind."
                .to_owned(),
            value: Some(0.41),
            ..base(Code::TD501, Verdict::Info)
        },
    ]
}

pub(crate) use golden::assert_golden;

#[cfg(test)]
mod golden {
    /// Compares with a file in `src/`; with `UPDATE_GOLDEN=1` in the environment writes it instead.
    pub(crate) fn assert_golden(name: &str, text: &str) {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src").join(name);
        if std::env::var_os("UPDATE_GOLDEN").is_some() {
            std::fs::write(&path, text).expect("the folder is there");
        }
        let golden = std::fs::read_to_string(&path).unwrap_or_default();
        let differing = golden.lines().zip(text.lines()).position(|(old, new)| old != new);
        assert!(
            golden == text,
            "{} differs from line {} on; if that is meant, run with UPDATE_GOLDEN=1",
            path.display(),
            differing.unwrap_or(golden.lines().count().min(text.lines().count())) + 1
        );
    }
}
