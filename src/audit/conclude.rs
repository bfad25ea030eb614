//! From what was seen to findings.

use super::{Audit, Error, FrameAudit, Method, Options, Progress, Stage};
use crate::{
    board::{CharucoBoard, Layout},
    calibrate::{
        self, BoardSurface, Calibration, DistortionTest, FrameCorners, KnownCamera, Parameter,
        RejectedFrame, Rejection, distortion_test,
    },
    camera::{Camera, Distortion},
    depth::{
        BoardDepth, Patches, RegisterInput, against_board, handedness, patches, register, sense,
        temporal_noise,
    },
    detect::{Corner, Observation},
    diagnose::{Case, Device, SAME_CAMERA, depth_state, diagnose},
    geom::Pixel,
    image::DepthMap,
    pose::{View, Weighting},
    recording::{Factory, Problem},
};

/// Views with fewer corners are not compared: the paper's least number, too.
const LEAST_CORNERS: usize = 9;

/// What no corner is better than, pixels: the boards of the published recordings are uneven by 0.8 mm, which is a tenth
/// of a pixel and more at their distance.
const CORNER_FLOOR_PX: f64 = 0.1;

/// What is known of a recording beside its images.
pub(super) struct Ground<'a> {
    pub(super) name: &'a str,
    /// For messages.
    pub(super) place: &'a str,
    pub(super) problems: &'a [Problem],
    /// Of the recording.
    pub(super) factory: Option<&'a Factory>,
    /// Of each frame.
    pub(super) factories: Vec<Option<&'a Factory>>,
}

/// A frame whose corners are known already: from a detector of one's own, or simulated.
#[derive(Clone, Debug)]
pub struct Seen {
    /// Time since the first frame, nanoseconds.
    pub t_ns: i64,
    /// Columns and rows of the colour image.
    pub size_px: [usize; 2],
    /// What was seen of the board.
    pub observation: Observation,
    /// The depth map, of the size of the colour image.
    pub depth: Option<DepthMap>,
}

/// As [`audit`](super::audit), from frames that were looked at elsewhere: no image is decoded, no corner detected.
///
/// Errors: no board in the options; a camera given for images of another size.
pub fn audit_seen(
    name: &str,
    factory: Option<&Factory>,
    seen: Vec<Seen>,
    options: &Options,
) -> Result<Audit, Error> {
    let no_board = || Error::NoBoard { recording: name.to_owned() };
    let board = options.board.clone().ok_or_else(no_board)?;
    let ground =
        Ground { name, place: name, problems: &[], factory, factories: vec![factory; seen.len()] };
    let frames = seen.into_iter().map(|seen| FrameAudit::from_seen(seen, &board)).collect();
    conclude(&ground, board, frames, options, &|_| {})
}

impl FrameAudit {
    /// Nothing seen yet.
    pub(super) fn blank(timestamp: i64, t_ns: i64) -> Self {
        Self {
            timestamp,
            t_ns,
            color: None,
            depth: None,
            size_px: None,
            observation: Observation { corners: Vec::new(), identity: None, rejects: Vec::new() },
            sensor_m: Vec::new(),
            patches: None,
            holes: None,
            factory_view: None,
            own_view: None,
        }
    }

    fn from_seen(seen: Seen, board: &CharucoBoard) -> Self {
        let mut frame = Self::blank(seen.t_ns / 1_000_000, seen.t_ns);
        frame.size_px = Some(seen.size_px);
        frame.observation = seen.observation;
        if let Some(map) = &seen.depth {
            frame.read_depth(map, board);
        }
        frame
    }

    /// What the depth map says where the board was seen.
    pub(super) fn read_depth(&mut self, map: &DepthMap, board: &CharucoBoard) {
        self.sensor_m = sense(map, &self.observation.corners);
        self.patches = patches(map, board, &self.observation.corners);
        let n_holes = map.depth_m().iter().filter(|depth| depth.is_nan()).count();
        self.holes = Some(n_holes as f64 / map.depth_m().len() as f64);
    }
}

pub(super) fn conclude(
    ground: &Ground<'_>,
    mut board: CharucoBoard,
    mut frames: Vec<FrameAudit>,
    options: &Options,
    observer: &(dyn Fn(Progress) + Sync),
) -> Result<Audit, Error> {
    let layout = most_seen_layout(&frames, board.layout);
    // What is seen goes before what was said: markers of the other layout are nowhere near.
    board.layout = layout.or(board.layout);
    let size_px = frames.iter().find_map(|f| f.size_px);
    let factory = ground.factory;
    let n_frames = frames.len();

    observer(Progress { stage: Stage::Calibrate, done: 0, total: 1 });
    let own = own_camera(ground, options, &board, &frames)?;
    observer(Progress { stage: Stage::Calibrate, done: 1, total: 1 });

    observer(Progress { stage: Stage::Judge, done: 0, total: 1 });
    for (index, (frame, of_frame)) in frames.iter_mut().zip(&ground.factories).enumerate() {
        let corners = &frame.observation.corners;
        if corners.len() < LEAST_CORNERS {
            continue;
        }
        let pinhole = of_frame.or(factory).map(|f| f.intrinsics);
        frame.factory_view = pinhole.and_then(|intrinsics| {
            let camera = Camera { intrinsics, distortion: Distortion::None };
            View::from_corners(index, &board, &camera, corners, Weighting::Equal).ok()
        });
        frame.own_view = own.view(index, &board, corners);
    }
    let factory_depth =
        factory.is_some().then(|| compare(&board, None, &frames, |f| f.factory_view.as_ref()));
    let own_depth = own
        .camera
        .is_some()
        .then(|| compare(&board, own.surface(), &frames, |f| f.own_view.as_ref()));
    let pairs = own.views_with_depth(&frames);
    let registration = own.camera.as_ref().and_then(|camera| {
        let (parameters, covariance) = own.uncertainty();
        let tables = factory.and_then(|f| f.tables.as_ref());
        let pinhole = Camera { intrinsics: camera.intrinsics, distortion: Distortion::None };
        let other = |at: Pixel| match (&camera.distortion, tables) {
            // The colour image is distorted: a rectified depth map shows where the lens puts its pixels.
            (Distortion::Brown(_) | Distortion::Table(_), _) => {
                camera.project_ray(pinhole.unproject(at)?)
            }
            (Distortion::None, Some(tables)) => tables.undistort(at),
            (Distortion::None, None) => None,
        };
        let known = camera.distortion != Distortion::None || tables.is_some();
        register(&RegisterInput {
            board: &board,
            camera,
            parameters,
            covariance,
            surface: own.surface(),
            views: &pairs,
            other_state: if known { Some(&other) } else { None },
        })
    });
    let distortion = own.distortion(ground, &board, &frames);
    let handedness = (!pairs.is_empty()).then(|| handedness(&board, own.surface(), &pairs));
    drop(pairs);
    let temporal_noise = temporal_noise(
        &frames
            .iter()
            .map(|f| Some((f.observation.corners.as_slice(), f.patches.as_ref()?)))
            .collect::<Vec<_>>(),
    );
    let lens_share = registration.as_ref().and_then(|r| r.lens_share);
    let (findings, distortion_state) = diagnose(&Case {
        problems: ground.problems,
        n_frames,
        size_px,
        factory,
        board: &board,
        observations: &frames.iter().map(|f| &f.observation).collect::<Vec<_>>(),
        calibration: own.calibration.as_ref(),
        no_calibration: own.why_not.as_deref(),
        camera: own.camera.as_ref(),
        given: own.given.as_ref(),
        factory_views: &frames.iter().filter_map(|f| f.factory_view.as_ref()).collect::<Vec<_>>(),
        own_views: &frames.iter().filter_map(|f| f.own_view.as_ref()).collect::<Vec<_>>(),
        factory_depth: factory_depth.as_ref(),
        own_depth: own_depth.as_ref(),
        registration: registration.as_ref(),
        temporal_noise: Some(&temporal_noise),
        distortion: distortion.as_ref(),
        steps: &frames.iter().filter_map(|f| f.patches.as_ref()?.steps).collect::<Vec<_>>(),
        t_ns: &frames.iter().map(|f| f.t_ns).collect::<Vec<_>>(),
        handedness,
        tolerances: options.tolerances,
    });
    let depth_distortion_state = depth_state(distortion_state, lens_share);
    observer(Progress { stage: Stage::Judge, done: 1, total: 1 });
    Ok(Audit {
        name: ground.name.to_owned(),
        method: options.method.clone(),
        device: Device::from_factory(factory),
        board,
        layout,
        problems: ground.problems.to_vec(),
        factory: factory.cloned(),
        frames,
        calibration: own.calibration,
        no_calibration: own.why_not,
        camera: own.camera,
        factory_depth,
        own_depth,
        registration,
        temporal_noise,
        handedness,
        distortion,
        distortion_state,
        depth_distortion_state,
        findings,
    })
}

fn most_seen_layout(frames: &[FrameAudit], said: Option<Layout>) -> Option<Layout> {
    let count = |layout| {
        frames
            .iter()
            .filter_map(|f| f.observation.identity.as_ref())
            .filter(|i| i.layout == layout)
            .count()
    };
    let (legacy, new) = (count(Layout::Legacy), count(Layout::New));
    match legacy + new {
        0 => None,
        _ if new > legacy => Some(Layout::New),
        _ if new == legacy => said.or(Some(Layout::Legacy)),
        _ => Some(Layout::Legacy),
    }
}

fn compare<'a>(
    board: &CharucoBoard,
    surface: Option<&BoardSurface>,
    frames: &'a [FrameAudit],
    view: impl Fn(&'a FrameAudit) -> Option<&'a View>,
) -> BoardDepth {
    let sensed: Vec<_> = frames
        .iter()
        .filter(|frame| !frame.sensor_m.is_empty())
        .filter_map(|frame| {
            let view = view(frame)?;
            // A view may have left out corners of the observation; both are in order of ids.
            let mut seen = frame.observation.corners.iter().zip(&frame.sensor_m);
            let sensor_m: Vec<_> = view
                .corners
                .iter()
                .map(|corner| {
                    seen.find(|(seen, _)| seen.id == corner.id).and_then(|(_, depth)| *depth)
                })
                .collect();
            Some((view, sensor_m))
        })
        .collect();
    let pairs: Vec<_> =
        sensed.iter().map(|(view, sensor_m)| (*view, sensor_m.as_slice())).collect();
    against_board(board, surface, &pairs)
}

/// The own camera, or why there is none.
#[derive(Default)]
struct Own {
    camera: Option<Camera>,
    calibration: Option<Calibration>,
    /// Where the camera is given.
    given: Option<KnownCamera>,
    why_not: Option<String>,
}

impl Own {
    fn surface(&self) -> Option<&BoardSurface> {
        self.calibration.as_ref().and_then(|c| c.surface.as_ref())
    }

    /// The camera's free numbers and their covariance; none of a camera that is exact or not known.
    fn uncertainty(&self) -> (&[Parameter], &[f64]) {
        match (&self.calibration, &self.given) {
            (Some(calibration), _) => (&calibration.parameters, &calibration.covariance),
            (None, Some(given)) => (&given.parameters, &given.covariance),
            (None, None) => (&[], &[]),
        }
    }

    /// The calibration's own test, or one beside a calibration that has none (method paper, camera given).
    fn distortion(
        &self,
        ground: &Ground<'_>,
        board: &CharucoBoard,
        frames: &[FrameAudit],
    ) -> Option<DistortionTest> {
        if let Some(test) = self.calibration.as_ref().and_then(|c| c.distortion.as_ref()) {
            return Some(test.clone());
        }
        self.camera.as_ref()?;
        let frames = corners_by_frame(frames);
        distortion_test(&input(ground.factory?, board, &frames))
    }

    /// The views that the calibration found, or else those of `frames`, where there is depth.
    fn views_with_depth<'a>(&'a self, frames: &'a [FrameAudit]) -> Vec<(&'a View, &'a Patches)> {
        let views: Vec<&View> = match &self.calibration {
            Some(calibration) => calibration.views.iter().collect(),
            None if self.camera.is_some() => {
                frames.iter().filter_map(|f| f.own_view.as_ref()).collect()
            }
            None => frames.iter().filter_map(|f| f.factory_view.as_ref()).collect(),
        };
        views
            .into_iter()
            .filter_map(|view| Some((view, frames[view.frame].patches.as_ref()?)))
            .collect()
    }

    /// The board's pose in a frame with the own camera, corners left out that disagree with all others: where the
    /// board has a shape, that of the calibration, which knows it.
    fn view(&self, index: usize, board: &CharucoBoard, corners: &[Corner]) -> Option<View> {
        let camera = self.camera.as_ref()?;
        if let Some(calibration) = self.calibration.as_ref().filter(|c| c.surface.is_some())
            && let Some(view) = calibration.views.iter().find(|view| view.frame == index)
        {
            return Some(view.clone());
        }
        let mut corners = corners.to_vec();
        if let Some(calibration) = &self.calibration {
            let disagrees = |r: &RejectedFrame| {
                r.frame == index && matches!(r.reason, Rejection::Disagrees { .. })
            };
            if calibration.rejected.iter().any(disagrees) {
                return None;
            }
            corners
                .retain(|c| !calibration.outliers.iter().any(|o| o.frame == index && o.id == c.id));
        }
        let weighting = Weighting::Sigma { floor_px: CORNER_FLOOR_PX };
        View::from_corners(index, board, camera, &corners, weighting).ok()
    }
}

fn own_camera(
    ground: &Ground<'_>,
    options: &Options,
    board: &CharucoBoard,
    frames: &[FrameAudit],
) -> Result<Own, Error> {
    let size_px = frames.iter().find_map(|f| f.size_px);
    let method = match &options.method {
        Method::Given(given) => {
            let given = &**given;
            if let Some(size) = size_px {
                given.camera.check_size(size, ground.place)?;
            }
            let recorded = ground.factory.map(|factory| factory.intrinsics.focal_px());
            // A recording that was corrected by this very calibration has its focal length.
            let is_near = |px: f64, other_px: f64| (px / other_px - 1.0).abs() <= SAME_CAMERA;
            let own_px = given.camera.intrinsics.focal_px();
            if let (Some(given_px), Some(recorded_px)) = (given.factory_focal_px, recorded)
                && !is_near(given_px, recorded_px)
                && !is_near(own_px, recorded_px)
            {
                let recording = ground.place.to_owned();
                return Err(Error::OtherCamera { recording, given_px, recorded_px });
            }
            let camera = Some(given.camera.clone());
            return Ok(Own { camera, given: Some(given.clone()), ..Own::default() });
        }
        Method::Paper => calibrate::Method::Paper,
        Method::Auto => calibrate::Method::Auto,
    };
    let why_not = |why: String| Ok(Own { why_not: Some(why), ..Own::default() });
    let frames = corners_by_frame(frames);
    if frames.is_empty() {
        return why_not("the board was not seen in any frame".to_owned());
    }
    let Some(factory) = ground.factory else {
        return why_not("the recording has no factory intrinsics to start from".to_owned());
    };
    let input = input(factory, board, &frames);
    match calibrate::calibrate_from(&input, method, options.max_views) {
        Ok(calibration) => Ok(Own {
            camera: Some(calibration.camera.clone()),
            calibration: Some(calibration),
            ..Own::default()
        }),
        Err(error) => why_not(why_not_calibrated(&error)),
    }
}

fn input<'a>(
    factory: &'a Factory,
    board: &'a CharucoBoard,
    frames: &'a [FrameCorners],
) -> calibrate::Input<'a> {
    let tables = factory.tables.as_ref();
    calibrate::Input { board, factory: &factory.intrinsics, tables, frames }
}

fn corners_by_frame(frames: &[FrameAudit]) -> Vec<FrameCorners> {
    frames
        .iter()
        .enumerate()
        .filter(|(_, frame)| !frame.observation.corners.is_empty())
        .map(|(index, frame)| FrameCorners {
            frame: index,
            corners: frame.observation.corners.clone(),
        })
        .collect()
}

/// For the end of a sentence. Findings tell the remedy themselves.
fn why_not_calibrated(error: &calibrate::Error) -> String {
    match error {
        calibrate::Error::TooFewViews { n_frames, n_views, needed, min_corners } => format!(
            "{n_views} of {n_frames} frames with the board are of use for a calibration (at least {min_corners} \
             corners, spread in both directions, from a place of their own), and it takes {needed}"
        ),
        calibrate::Error::Underdetermined { n_views, n_pictures, max_tilt_deg, focal_px } => {
            format!(
                "the {n_views} views of the board ({n_pictures} different, tilted by at most {max_tilt_deg:.0} \
                 degrees) do not determine a focal length{}",
                focal_px.map_or(String::new(), |f| format!(
                    ", which comes out as {:.0} +- {:.0} px",
                    f.value, f.sigma
                ))
            )
        }
        other => other.to_string(),
    }
}
