//! The checks on synthetic corners and depth with one thing wrong at a time, by way of a camera given from outside.

use std::sync::LazyLock;

use super::{Api, Case, Code, Finding, Sheet, Side, Tolerances, Verdict, compare, diagnose};
use crate::{
    board::{CharucoBoard, Layout},
    calibrate::{FrameCorners, Input, Method, Model, calibrate, distortion_test},
    camera::{Camera, Distortion, Intrinsics, RadialTable, TablePair},
    depth::{
        BoardDepth, CornerDepth, DepthSteps, Lattice, Patch, Patches, RegisterInput, Texture,
        against_board, handedness, register,
    },
    detect::{Corner, Identity, Observation},
    geom::{Board, Color, Pixel, Pose, Rotation, Vector3},
    math,
    pose::{View, Weighting},
    recording::{Defect, Factory, Problem, StreamState},
};

static BOARD: LazyLock<CharucoBoard> = LazyLock::new(|| CharucoBoard::paper(0.020875).unwrap());

pub(super) struct Noise(pub(super) u64);

impl Noise {
    pub(super) fn uniform(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(super) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

pub(super) fn pinhole(focal_px: f64) -> Intrinsics {
    Intrinsics { fx: focal_px, fy: focal_px, cx: 318.9, cy: 239.8, width: 640, height: 480 }
}

/// Like the iPad's: 4 px at the corner.
pub(super) fn tables() -> TablePair {
    let table = (0..42).map(|i| -0.01 * (f64::from(i) / 41.0).powi(2)).collect();
    TablePair::from_inverse(RadialTable::new(Pixel::new(318.9, 239.8), 400.0, table).unwrap())
}

/// A recording with known truth.
struct World {
    /// The camera that drew the images.
    truth: Camera,
    /// Sensor = scale · depth + bias.
    scale: f64,
    bias_m: f64,
    /// The depth map shows the colour image's pixel c + zoom·(q − shift − c) at q.
    zoom: f64,
    shift_px: [f64; 2],
    depth_mirrored: bool,
    steps: DepthSteps,
    /// Smallest and largest distance of the board, metres.
    range_m: [f64; 2],
    mirrored: bool,
    factory: Factory,
    /// Taken as exact.
    own: Option<Camera>,
    /// A calibration from these corners, with residuals of this size.
    calibrated_rms_px: Option<f64>,
    problems: Vec<Problem>,
}

impl World {
    fn true_one() -> Self {
        let camera = Camera { intrinsics: pinhole(596.0), distortion: Distortion::None };
        let mut factory = Factory::pinhole(pinhole(596.0));
        factory.tables = Some(tables());
        factory.distortion_center = Some(Pixel::new(318.9, 239.8));
        Self {
            own: Some(camera.clone()),
            truth: camera,
            scale: 1.0,
            bias_m: 0.0,
            zoom: 1.0,
            shift_px: [0.0; 2],
            depth_mirrored: false,
            steps: DepthSteps { n_levels: 1400, step_share: 0.0003 },
            range_m: [0.2, 0.45],
            mirrored: false,
            calibrated_rms_px: None,
            factory,
            problems: Vec::new(),
        }
    }

    /// What the sensor says of the board at this pose.
    fn patches(&self, pose: &Pose<Color, Board>, corners: &[Corner], noise: &mut Noise) -> Patches {
        let pinhole = &self.truth.intrinsics;
        let normal = pose.rotation * Vector3::z();
        let depth = |q: Pixel| {
            let window = |q: f64, shift: f64, c: f64| c + self.zoom * (q - shift - c);
            let p = Pixel::new(
                window(q.x, self.shift_px[0], pinhole.cx),
                window(q.y, self.shift_px[1], pinhole.cy),
            );
            let [u, v] = self.truth.unproject(p)?;
            let ray = Vector3::new(u, v, 1.0);
            let depth_m = normal.dot(&pose.translation) / normal.dot(&ray);
            let on_board = pose.rotation.inverse() * (ray * depth_m - pose.translation);
            let inside = (0.0..0.20875).contains(&on_board.x) && (0.0..0.167).contains(&on_board.y);
            Some((self.scale * depth_m + self.bias_m, inside))
        };
        let side_px = 16;
        let mut measured = Vec::new();
        for (x, y) in (0..30).flat_map(|j| (0..40).map(move |i| (16 * i, 16 * j))) {
            let at = Pixel::new(f64::from(x) + 7.5, f64::from(y) + 7.5);
            if let Some((depth_m, true)) = depth(at) {
                measured.push(Patch {
                    at,
                    inverse_per_m: (depth_m + 0.0002 * noise.normal()).recip(),
                    noise_m: 0.0003,
                    n: 256,
                    n_holes: 0,
                });
            }
        }
        let corners = corners
            .iter()
            .map(|corner| {
                let mirrored = Pixel::new(639.0 - corner.pixel.x, corner.pixel.y);
                let [here, there] = [corner.pixel, mirrored].map(|q| Some(depth(q)?.0));
                let [straight_m, mirrored_m] =
                    if self.depth_mirrored { [there, here] } else { [here, there] };
                CornerDepth { id: corner.id, straight_m, mirrored_m }
            })
            .collect();
        Patches {
            side_px,
            measured,
            torn: Vec::new(),
            steps: Some(self.steps),
            corners,
            texture: Texture::nothing(),
            lattice: Lattice::default(),
        }
    }

    fn judge(&self) -> (Vec<Finding>, StreamState) {
        let mut noise = Noise(11);
        let mut observations = Vec::new();
        let mut factory_views = Vec::new();
        let mut own_views = Vec::new();
        let mut sensed = Vec::new();
        let mut patches = Vec::new();
        let straight = Camera { intrinsics: self.factory.intrinsics, distortion: Distortion::None };
        for frame in 0..20 {
            let axis = Vector3::new(noise.normal(), noise.normal(), 0.0).normalize();
            let rotation = Rotation::from_scaled_axis(axis * (0.3 + 0.4 * noise.uniform()));
            let [near, far] = self.range_m;
            let distance_m = near + (far - near) * noise.uniform();
            let target = Vector3::new(0.04 * noise.normal(), 0.03 * noise.normal(), distance_m);
            let centre = Vector3::new(0.104, 0.0835, 0.0);
            let pose: Pose<Color, Board> = Pose::new(rotation, target - rotation * centre);
            let mut corners = Vec::new();
            let mut depths = Vec::new();
            for id in 0..BOARD.n_corners() {
                let point = pose * BOARD.corner(id);
                let Some(pixel) = self.truth.project(point) else { continue };
                let pixel =
                    Pixel::new(pixel.x + 0.05 * noise.normal(), pixel.y + 0.05 * noise.normal());
                if (0.0..639.0).contains(&pixel.x) && (0.0..479.0).contains(&pixel.y) {
                    corners.push(Corner { id, pixel, sigma_px: 0.05 });
                    depths
                        .push(Some(self.scale * point.z() + self.bias_m + 0.0005 * noise.normal()));
                }
            }
            let fit = |camera| {
                View::from_corners(frame, &BOARD, camera, &corners, Weighting::Equal).unwrap()
            };
            factory_views.push(fit(&straight));
            own_views.extend(self.own.as_ref().map(fit));
            sensed.push(depths);
            patches.push(self.patches(&pose, &corners, &mut noise));
            let identity = Identity {
                layout: Layout::Legacy,
                mirrored: self.mirrored,
                inverted: false,
                markers: (0..10).collect(),
                margin: 50.0,
            };
            observations.push(Observation {
                corners,
                identity: Some(identity),
                rejects: Vec::new(),
            });
        }
        let compare = |views: &[View]| -> BoardDepth {
            let pairs: Vec<_> = views.iter().zip(&sensed).map(|(v, s)| (v, s.as_slice())).collect();
            against_board(&BOARD, None, &pairs)
        };
        let factory_depth = compare(&factory_views);
        let own_depth = self.own.is_some().then(|| compare(&own_views));
        let views = if self.own.is_some() { &own_views } else { &factory_views };
        let pairs: Vec<_> = views.iter().zip(&patches).collect();
        let registration = self.own.as_ref().and_then(|camera| {
            register(&RegisterInput {
                board: &BOARD,
                camera,
                parameters: &[],
                covariance: &[],
                surface: None,
                views: &pairs,
                other_state: None,
            })
        });
        let frames: Vec<FrameCorners> = observations
            .iter()
            .enumerate()
            .map(|(frame, o)| FrameCorners { frame, corners: o.corners.clone() })
            .collect();
        let distortion = self.own.as_ref().and_then(|_| {
            let tables = self.factory.tables.as_ref();
            let factory = &self.factory.intrinsics;
            distortion_test(&Input { board: &BOARD, factory, tables, frames: &frames })
        });
        let calibration = self.calibrated_rms_px.map(|rms_px| {
            let factory = &self.factory.intrinsics;
            let input = Input { board: &BOARD, factory, tables: None, frames: &frames };
            let mut found = calibrate(&input, Method::Robust(Model::Focal)).unwrap();
            found.rms_px = rms_px;
            found
        });
        diagnose(&Case {
            problems: &self.problems,
            n_frames: observations.len(),
            size_px: Some([640, 480]),
            factory: Some(&self.factory),
            board: &BOARD,
            n_seen: observations.len(),
            n_mirrored_of: (if self.mirrored { observations.len() } else { 0 }, observations.len()),
            calibration: calibration.as_ref(),
            no_calibration: None,
            camera: self.own.as_ref(),
            given: None,
            factory_depth: Some(&factory_depth),
            own_depth: own_depth.as_ref(),
            registration: registration.as_ref(),
            temporal_noise: None,
            distortion: distortion.as_ref(),
            steps: &[self.steps],
            t_ns: &(0..20).map(|i| 500_000_000 * i).collect::<Vec<_>>(),
            handedness: Some(handedness(&BOARD, None, &pairs)),
            tolerances: Tolerances::default(),
        })
    }

    fn finding(&self, code: Code) -> Finding {
        self.judge().0.into_iter().find(|f| f.code == code).unwrap()
    }

    /// Codes of the faults.
    fn faults(&self) -> Vec<Code> {
        self.judge().0.iter().filter(|f| f.verdict == Verdict::Fault).map(|f| f.code).collect()
    }
}

#[test]
fn a_true_recording_has_no_fault() {
    let (findings, state) = World::true_one().judge();
    assert_eq!(findings.iter().map(|f| f.code).collect::<Vec<_>>(), Code::ALL);
    assert_eq!(state, StreamState::Rectified);
    for finding in &findings {
        assert!(matches!(finding.verdict, Verdict::Ok | Verdict::Info), "{finding:?}");
        assert!(
            finding.claim.ends_with('.')
                && (finding.test.is_empty() || finding.test.ends_with('.')),
            "{finding:?}"
        );
        assert!(finding.defect.is_none(), "{finding:?}");
    }
}

#[test]
fn a_wrong_focal_length_is_one_fault_and_no_other() {
    let mut world = World::true_one();
    world.factory.intrinsics = pinhole(596.0 * 1.06);
    assert_eq!(world.faults(), [Code::TD201]);
    let finding = world.finding(Code::TD201);
    assert!((finding.value.unwrap() - 100.0 * (1.0 / 1.06 - 1.0)).abs() < 1e-9);
    let Some(Defect::Focal { ratio }) = finding.defect else { panic!() };
    assert!((ratio - 1.06).abs() < 1e-9);
}

#[test]
fn a_distorted_stream() {
    let mut world = World::true_one();
    world.truth.distortion = Distortion::Table(tables());
    // Whether the own camera knows of it or not.
    for distortion in [Distortion::None, world.truth.distortion.clone()] {
        world.own = Some(Camera { intrinsics: pinhole(596.0), distortion });
        assert_eq!(world.faults(), [Code::TD203]);
        let (findings, state) = world.judge();
        assert_eq!(state, StreamState::Distorted);
        let finding = findings.iter().find(|f| f.code == Code::TD203).unwrap();
        // 4 px along the diagonal at the corner.
        assert!((finding.value.unwrap() - 4.0).abs() < 0.15, "{finding:?}");
        assert_eq!(finding.defect, Some(Defect::Distorted));
    }
}

#[test]
fn rectified_twice() {
    let mut world = World::true_one();
    // The lens bends the other way.
    let table = tables();
    let swapped = RadialTable::new(
        table.inverse.center,
        table.inverse.max_radius_px,
        table.inverse.magnification.iter().map(|m| -m).collect(),
    )
    .unwrap();
    world.truth.distortion = Distortion::Table(TablePair::from_inverse(swapped));
    let (_, state) = world.judge();
    assert_eq!(state, StreamState::RectifiedTwice);
    assert_eq!(world.faults(), [Code::TD204]);
    assert!(world.finding(Code::TD204).value.unwrap() > 2.0);
}

#[test]
fn depth_faults() {
    let mut world = World::true_one();
    world.scale = 0.97;
    assert_eq!(world.faults(), [Code::TD301]);
    let finding = world.finding(Code::TD301);
    assert!((finding.value.unwrap() + 3.0).abs() < 3.0 * finding.sigma.unwrap(), "{finding:?}");

    let mut world = World::true_one();
    world.bias_m = 0.006;
    assert_eq!(world.faults(), [Code::TD302]);
    let finding = world.finding(Code::TD302);
    assert!((finding.value.unwrap() - 6.0).abs() < 3.0 * finding.sigma.unwrap(), "{finding:?}");
}

/// A focal length that nobody knows must not become the sensor's fault.
#[test]
fn no_camera_no_verdict_on_depth() {
    let mut world = World::true_one();
    world.factory.intrinsics = pinhole(596.0 * 1.06);
    world.own = None;
    assert_eq!(world.faults(), []);
    for code in [Code::TD201, Code::TD203, Code::TD301, Code::TD302] {
        let finding = world.finding(code);
        assert_eq!(finding.verdict, Verdict::Unknown, "{finding:?}");
        assert!(finding.what_to_do.contains("Record"), "{finding:?}");
        assert_eq!(finding.value, None);
    }
}

/// At one distance a scale cannot be told from a bias, but depth is wrong all the same, once.
#[test]
fn one_distance() {
    let mut world = World::true_one();
    world.range_m = [0.3, 0.301];
    world.scale = 0.97;
    let faults = world.faults();
    assert_eq!(faults, [Code::TD301]);
}

#[test]
fn mirrored() {
    let mut world = World::true_one();
    world.mirrored = true;
    assert_eq!(world.faults(), [Code::TD403]);
    assert_eq!(world.finding(Code::TD403).defect, Some(Defect::Mirrored));
}

#[test]
fn intrinsics_left_at_the_reference_size() {
    let mut world = World::true_one();
    let k = pinhole(596.0);
    let by = 3088.0 / 640.0;
    world.factory.intrinsics =
        Intrinsics { fx: k.fx * by, fy: k.fy * by, cx: k.cx * by, cy: k.cy * by, ..k };
    world.factory.reference_dimensions = Some([3088.0, 2316.0]);
    let finding = world.finding(Code::TD503);
    assert_eq!(finding.verdict, Verdict::Fault);
    let Some(Defect::IntrinsicsScale { factor: [x, y] }) = finding.defect else { panic!() };
    assert!((x * by - 1.0).abs() < 1e-9 && (y * by - 1.0).abs() < 1e-9);
    assert_eq!(world.finding(Code::TD504).verdict, Verdict::Fault);
}

#[test]
fn metadata_facts() {
    let mut world = World::true_one();
    world.factory.distortion_center = Some(Pixel::new(318.9, 239.4));
    world.factory.field_of_view_rad = Some(0.9);
    world.problems = vec![Problem::MetadataWithoutImages { timestamps: vec![1, 2] }];
    for (code, value) in [(Code::TD501, 0.4), (Code::TD504, 56.46), (Code::TD103, 1.0)] {
        let finding = world.finding(code);
        assert_eq!(finding.verdict, Verdict::Info, "{finding:?}");
        assert!((finding.value.unwrap() - value).abs() < 0.01, "{finding:?}");
    }
    world.problems.push(Problem::ColorWithoutDepth { timestamps: vec![3] });
    assert_eq!(world.finding(Code::TD101).verdict, Verdict::Warning);
}

#[test]
fn a_zoomed_depth_map_is_one_fault_and_no_other() {
    for zoom in [0.9507, 1.03] {
        let world = World { zoom, ..World::true_one() };
        assert_eq!(world.faults(), [Code::TD401]);
        let finding = world.finding(Code::TD401);
        let (value, sigma) = (finding.value.unwrap(), finding.sigma.unwrap());
        assert!((value - 100.0 * (zoom - 1.0)).abs() < 3.0 * sigma && sigma < 0.2, "{finding:?}");
        let Some(Defect::DepthZoom { zoom: [found, _] }) = finding.defect else {
            panic!("{finding:?}")
        };
        assert!((found - zoom).abs() < 0.005);
    }
}

#[test]
fn a_shifted_depth_map_is_one_fault_and_no_other() {
    let world = World { shift_px: [3.0, -2.0], ..World::true_one() };
    assert_eq!(world.faults(), [Code::TD402]);
    let finding = world.finding(Code::TD402);
    let Some(Defect::DepthShift { shift_px: [x, y] }) = finding.defect else {
        panic!("{finding:?}")
    };
    let sigma = finding.sigma.unwrap();
    assert!(math::hypot(x - 3.0, y + 2.0) < 4.0 * sigma && sigma < 0.3, "{finding:?}");
}

#[test]
fn a_mirrored_depth_map() {
    let world = World { depth_mirrored: true, ..World::true_one() };
    let finding = world.finding(Code::TD403);
    assert_eq!(finding.verdict, Verdict::Fault, "{finding:?}");
    assert_eq!(finding.defect, Some(Defect::DepthMirrored));
    assert_eq!(World::true_one().finding(Code::TD403).verdict, Verdict::Ok);
}

/// Each with the right finding, and no other.
#[test]
fn units_and_steps() {
    let world = World { scale: 10.0, ..World::true_one() };
    let finding = world.finding(Code::TD104);
    assert_eq!(finding.verdict, Verdict::Fault, "{finding:?}");
    assert_eq!(finding.defect, Some(Defect::DepthScale { ratio: 10.0 }));

    let steps = DepthSteps { n_levels: 180, step_share: 0.012 };
    let world = World { steps, ..World::true_one() };
    assert_eq!(world.finding(Code::TD105).verdict, Verdict::Warning);
    assert_eq!(world.faults(), []);

    // Something that falls where depth grows.
    let world = World { scale: -0.5, bias_m: 0.4, ..World::true_one() };
    assert_eq!(world.finding(Code::TD105).verdict, Verdict::Fault);
}

#[test]
fn a_wrong_principal_point() {
    let mut world = World::true_one();
    world.factory.intrinsics.cx += 6.0;
    let finding = world.finding(Code::TD202);
    assert_eq!(finding.verdict, Verdict::Fault, "{finding:?}");
    let Some(Defect::Center { shift_px: [x, y] }) = finding.defect else { panic!("{finding:?}") };
    assert!((x - 6.0).abs() < 1.0 && y.abs() < 1.0, "{finding:?}");
}

/// Mirrored images have their principal point mirrored: one fault (TD403), not two.
#[test]
fn the_principal_point_of_mirrored_images() {
    let mut world = World::true_one();
    world.truth.intrinsics.cx = 313.0;
    world.own = Some(world.truth.clone());
    world.factory.intrinsics.cx = 639.0 - 313.0;
    assert_eq!(world.finding(Code::TD202).verdict, Verdict::Fault);
    world.mirrored = true;
    let finding = world.finding(Code::TD202);
    assert!(matches!(finding.verdict, Verdict::Ok | Verdict::Info), "{finding:?}");
    assert!(finding.claim.contains("taken mirrored"), "{finding:?}");
    // A mirrored print: the images, and their principal point, are as they should be.
    world.factory.intrinsics.cx = 313.0;
    let finding = world.finding(Code::TD202);
    assert!(matches!(finding.verdict, Verdict::Ok | Verdict::Info), "{finding:?}");
    assert!(!finding.claim.contains("taken mirrored"), "{finding:?}");
}

/// What the metadata of two recordings say, without a registry.
#[test]
fn two_recordings() {
    let side = |width: f64, focal_px: f64, api| {
        let mut factory = Factory::pinhole(pinhole(focal_px * 640.0 / width));
        factory.reference_dimensions = Some([width, 0.75 * width]);
        Side { name: "r".to_owned(), api, sheet: Sheet::from_factory(&factory).unwrap() }
    };
    let pair = |av: (f64, f64), ar: (f64, f64)| {
        let sides = [(av, Api::AvFoundation), (ar, Api::ArKit)];
        let [first, second] = sides.map(|((width, focal), api)| side(width, focal, Some(api)));
        compare(first, second)
    };
    let first = pair((3088.0, 2872.5), (3248.0, 2872.5));
    assert_eq!(first.findings[0].verdict, Verdict::Warning);
    assert!(first.findings[0].what_to_do.contains("0.9507"), "{first:?}");
    let second = pair((2016.0, 1781.8), (2880.0, 1916.2));
    assert!(second.findings[0].claim.contains("issue 2"), "{second:?}");
    let iphone = pair((4032.0, 2751.0), (4032.0, 2751.0));
    assert_eq!(iphone.findings[0].verdict, Verdict::Ok);

    let change = |focal_px| {
        let pair = compare(side(2016.0, 1781.78, None), side(2016.0, focal_px, None));
        pair.findings[0].verdict
    };
    assert_eq!(change(1781.78), Verdict::Ok);
    assert_eq!(change(1780.13), Verdict::Warning); // iOS 15 on the 12.9-inch 5th generation
}

/// A board of another layout than was taken for granted leaves 4.8 px, and focal lengths that are wrong by percents.
#[test]
fn no_verdict_from_a_calibration_that_does_not_fit() {
    let mut world = World::true_one();
    world.factory.intrinsics = pinhole(596.0 * 1.06);
    world.zoom = 0.9507;
    world.calibrated_rms_px = Some(0.2);
    assert_eq!(world.faults(), [Code::TD201, Code::TD401]);
    world.calibrated_rms_px = Some(4.8);
    assert_eq!(world.faults(), []);
    let (findings, state) = world.judge();
    assert_eq!(state, StreamState::Unknown);
    for code in [Code::TD201, Code::TD202, Code::TD203, Code::TD204, Code::TD301, Code::TD401] {
        let finding = findings.iter().find(|f| f.code == code).unwrap();
        assert_eq!(finding.verdict, Verdict::Unknown, "{finding:?}");
        assert!(finding.claim.contains("4.80 px") && !finding.what_to_do.is_empty());
    }
}
