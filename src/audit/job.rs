//! The job itself.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::{
    Method, Options, Progress, Stage,
    conclude::{Ground, conclude},
};
use crate::{
    board::{CharucoBoard, Layout},
    calibrate::{Calibration, DistortionTest},
    camera::{Camera, OtherSize},
    depth::{BoardDepth, Handedness, Patches, Registration, TemporalNoise},
    detect::{Detector, Observation},
    diagnose::{Device, Finding, Verdict},
    image::Rgb,
    par,
    pose::View,
    recording::{self, Factory, Problem, Recording, StreamState},
};

/// Everything that can be known of a recording.
#[derive(Clone, Debug)]
pub struct Audit {
    /// Name of the recording, for people.
    pub name: String,
    /// Where the own intrinsics come from, as it was asked for.
    pub method: Method,
    /// Which camera made it.
    pub device: Device,
    /// The board that was looked for, with its layout where it was seen.
    pub board: CharucoBoard,
    /// The layout that was seen in most frames.
    pub layout: Option<Layout>,
    /// What was odd in the files.
    pub problems: Vec<Problem>,
    /// The factory's metadata: that of the first frame that has any.
    pub factory: Option<Factory>,
    /// Every frame of the recording, in order of time; `frame` indices elsewhere point in here.
    pub frames: Vec<FrameAudit>,
    /// The own intrinsics; `None` where the recording does not determine any (`no_calibration` says why) or they
    /// were given.
    pub calibration: Option<Calibration>,
    /// Why there is no calibration, in a sentence, where there is none.
    pub no_calibration: Option<String>,
    /// The own camera: calibrated or given.
    pub camera: Option<Camera>,
    /// Depth against the board with the factory's intrinsics taken as an ideal pinhole, as the paper does.
    pub factory_depth: Option<BoardDepth>,
    /// Depth against the board with the own camera.
    pub own_depth: Option<BoardDepth>,
    /// Depth against colour and truth, from the board's whole surface with the own camera; `None` without one, and
    /// where too few frames have depth on the board.
    pub registration: Option<Registration>,
    /// What comes and goes between successive depth maps in which nothing moved.
    pub temporal_noise: TemporalNoise,
    /// Whether the depth maps are mirrored against the colour images; `None` where no pose of the board is known.
    pub handedness: Option<Handedness>,
    /// How much of the lens' distortion is left in the stream, from the pixels; `None` where the views do not tell.
    pub distortion: Option<DistortionTest>,
    /// Whether the stream still carries the lens' distortion.
    pub distortion_state: StreamState,
    /// The same of the depth maps, which may be resampled without the colour images.
    pub depth_distortion_state: StreamState,
    /// What follows, by code.
    pub findings: Vec<Finding>,
}

impl Audit {
    /// Frames in which the board was seen.
    pub fn n_frames_with_board(&self) -> usize {
        self.frames.iter().filter(|f| !f.observation.corners.is_empty()).count()
    }

    /// True where a finding is a fault (exit code 3).
    pub fn has_faults(&self) -> bool {
        self.findings.iter().any(|f| f.verdict == Verdict::Fault)
    }
}

/// What is known of one frame.
#[derive(Clone, Debug)]
pub struct FrameAudit {
    /// The timestamp as written in the file; names the frame for people.
    pub timestamp: i64,
    /// Time since the first frame, nanoseconds.
    pub t_ns: i64,
    /// Name of the colour image inside the recording.
    pub color: Option<String>,
    /// Name of the depth image inside the recording.
    pub depth: Option<String>,
    /// Columns and rows of the colour image.
    pub size_px: Option<[usize; 2]>,
    /// What was seen of the board.
    pub observation: Observation,
    /// The sensor's depth at each corner, metres; `None` on holes. Empty where the frame has no depth or no corner.
    pub sensor_m: Vec<Option<f64>>,
    /// The depth map in and round the board's outline; `None` where there is none.
    pub patches: Option<Patches>,
    /// Fraction of the depth map without measurement; `None` where it was not read.
    pub holes: Option<f64>,
    /// The board's pose with the factory's intrinsics.
    pub factory_view: Option<View>,
    /// The board's pose with the own camera.
    pub own_view: Option<View>,
}

/// An audit that cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file of the recording cannot be read.
    #[error(transparent)]
    Recording(#[from] recording::Error),
    /// Neither the recording nor the caller tells the board.
    #[error(
        "{recording}: the board is not known. Put a board.toml or checkersize.txt into the recording, or give \
         --board 10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL (squares, side, marker side, dictionary)"
    )]
    NoBoard {
        /// Where the recording is.
        recording: String,
    },
    /// No frame has a colour image.
    #[error(
        "{recording}: none of its {n_frames} frames has a colour image, so there is nothing to find the board in; copy \
         the rgb_*.png files, too"
    )]
    NoImages {
        /// Where the recording is.
        recording: String,
        /// Frames in it.
        n_frames: usize,
    },
    /// Colour and depth of one frame differ in size.
    #[error(
        "{recording}: {color} is {}x{} pixels, {depth} is {}x{}: which depth belongs to which pixel is not known; \
         record both at one size (640x480)",
        .color_size[0], .color_size[1], .depth_size[0], .depth_size[1]
    )]
    Sizes {
        /// Where the recording is.
        recording: String,
        /// The colour image.
        color: String,
        /// Its columns and rows.
        color_size: [usize; 2],
        /// The depth image.
        depth: String,
        /// Its columns and rows.
        depth_size: [usize; 2],
    },
    /// A camera from outside for images of another size.
    #[error(transparent)]
    CameraSize(#[from] OtherSize),
    /// A calibration of another camera than the one that recorded: factory focal lengths more than 1.5 % apart.
    #[error(
        "{recording}: the calibration given is of another camera: its factory says {given_px:.1} px of focal length, \
         this recording's says {recorded_px:.1} px; calibrate the device that made this recording"
    )]
    OtherCamera {
        /// Where the recording is.
        recording: String,
        /// The factory's focal length beside the calibration.
        given_px: f64,
        /// The factory's focal length in the recording.
        recorded_px: f64,
    },
}

/// Is shown a frame's index and its colour image.
pub type Witness<'a> = &'a (dyn Fn(usize, &Rgb) + Sync);

/// Looks at everything. See [`audit_observed`] to be told how far it has come.
///
/// Errors: a file that cannot be read or decoded, no board known, no colour image at all, colour and depth of different
/// size. Everything else is an [`Audit`], if only one whose findings say "cannot tell".
pub fn audit(recording: &Recording, options: &Options) -> Result<Audit, Error> {
    audit_observed(recording, options, &|_| {})
}

/// As [`audit`]; calls `observer` (from any thread) when a step is done.
pub fn audit_observed(
    recording: &Recording,
    options: &Options,
    observer: &(dyn Fn(Progress) + Sync),
) -> Result<Audit, Error> {
    audit_watched(recording, options, observer, None)
}

/// As [`audit_observed`]; calls `witness` (from any thread) with each colour image that is looked at, so that who wants
/// something of it need not decode it again.
///
/// Errors: as [`audit`].
pub fn audit_watched(
    recording: &Recording,
    options: &Options,
    observer: &(dyn Fn(Progress) + Sync),
    witness: Option<Witness<'_>>,
) -> Result<Audit, Error> {
    let place = || recording.place().to_owned();
    let board = options.board.as_ref().or(recording.board.as_ref());
    let board = board.cloned().ok_or_else(|| Error::NoBoard { recording: place() })?;
    let n_frames = recording.frames.len();
    if recording.frames.iter().all(|f| f.color.is_none()) {
        return Err(Error::NoImages { recording: place(), n_frames });
    }

    let frames = look(recording, &board, observer, witness)?;
    let ground = Ground {
        name: &recording.name,
        place: recording.place(),
        problems: &recording.problems,
        factory: recording.factory(),
        factories: recording.frames.iter().map(|f| f.factory.as_deref()).collect(),
    };
    conclude(&ground, board, frames, options, observer)
}

/// Every frame: the image decoded, the corners detected, depth read at them, the image dropped.
fn look(
    recording: &Recording,
    board: &CharucoBoard,
    observer: &(dyn Fn(Progress) + Sync),
    witness: Option<Witness<'_>>,
) -> Result<Vec<FrameAudit>, Error> {
    let detector = Detector::new(board);
    let total = recording.frames.len();
    let done = AtomicUsize::new(0);
    observer(Progress { stage: Stage::Detect, done: 0, total });
    let one = |&index: &usize| {
        let frame = look_at(recording, board, &detector, (index, witness));
        let done = 1 + done.fetch_add(1, Ordering::Relaxed);
        observer(Progress { stage: Stage::Detect, done, total });
        frame
    };
    let frames: Vec<usize> = (0..total).collect();
    par::try_map(&frames, one)
}

fn look_at(
    recording: &Recording,
    board: &CharucoBoard,
    detector: &Detector,
    (index, witness): (usize, Option<Witness<'_>>),
) -> Result<FrameAudit, Error> {
    let source = &recording.frames[index];
    let mut frame = FrameAudit {
        color: source.color.clone(),
        depth: source.depth.clone(),
        ..FrameAudit::blank(source.timestamp, source.t_ns)
    };
    let Some(color) = &source.color else { return Ok(frame) };
    let gray = match witness {
        None => recording.gray(index)?,
        Some(witness) => {
            let image = recording.rgb(index)?;
            witness(index, &image);
            image.to_gray()
        }
    };
    let color_size = [gray.width(), gray.height()];
    frame.size_px = Some(color_size);
    frame.observation = detector.detect(&gray);
    drop(gray);
    if let Some(depth) = &source.depth
        && !frame.observation.corners.is_empty()
    {
        let map = recording.depth(index)?;
        let depth_size = [map.width(), map.height()];
        if depth_size != color_size {
            return Err(Error::Sizes {
                recording: recording.place().to_owned(),
                color: color.clone(),
                color_size,
                depth: depth.clone(),
                depth_size,
            });
        }
        frame.read_depth(&map, board);
    }
    Ok(frame)
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use super::*;
    use crate::{
        calibrate::KnownCamera,
        camera::{Distortion, Intrinsics},
        image::{DepthMap, Rgb},
        recording::{Limits, Memory, Writer},
    };

    /// Grey images without a board.
    fn files() -> Memory {
        let intrinsics =
            Intrinsics { fx: 60.0, fy: 60.0, cx: 31.5, cy: 23.5, width: 64, height: 48 };
        let factory = Factory::pinhole(intrinsics);
        let mut writer = Writer::new(Memory::new("blank"));
        for t_ms in [100, 600, 1100] {
            let color = Rgb::new(64, 48, vec![[90; 3]; 64 * 48]);
            let depth = DepthMap::new(64, 48, vec![0.3; 64 * 48]);
            writer.frame(t_ms, &color, &depth, &factory).expect("writes");
        }
        writer.finish().expect("finishes")
    }

    fn open(files: Memory) -> Recording {
        Recording::from_source(Arc::new(files), &Limits::default()).expect("opens")
    }

    fn options() -> Options {
        let board = CharucoBoard::paper(0.020875).expect("a board");
        Options { board: Some(board), ..Options::new(Method::Auto) }
    }

    #[test]
    fn no_board_in_any_frame_is_no_error() {
        let audit = audit(&open(files()), &options()).expect("an audit");
        assert_eq!(audit.n_frames_with_board(), 0);
        assert!(!audit.has_faults() && audit.calibration.is_none() && audit.camera.is_none());
        assert!(audit.no_calibration.expect("a reason").contains("not seen in any frame"));
        assert_eq!(audit.distortion_state, StreamState::Unknown);
        for finding in audit.findings.iter().filter(|f| f.verdict == Verdict::Unknown) {
            assert!(!finding.what_to_do.is_empty(), "{finding:?}");
        }
        let unknown = audit.findings.iter().filter(|f| f.verdict == Verdict::Unknown).count();
        assert!(unknown >= 5, "{unknown}");
    }

    #[test]
    fn no_board_known() {
        let error = audit(&open(files()), &Options::new(Method::Auto)).expect_err("no board");
        assert!(matches!(error, Error::NoBoard { .. }), "{error}");
        assert!(error.to_string().contains("--board"), "{error}");
    }

    #[test]
    fn a_truncated_image_is_named() {
        let mut cut = files();
        let name = cut.files().keys().find(|n| n.contains("rgb_600")).expect("is there").clone();
        let bytes = cut.get(&name).expect("is there");
        let half = bytes[..bytes.len() / 2].to_vec();
        cut.insert(name, half);
        let error = audit(&open(cut), &options()).expect_err("half an image");
        assert!(error.to_string().contains("rgb_600.png"), "{error}");
    }

    #[test]
    fn a_camera_of_another_size() {
        let intrinsics =
            Intrinsics { fx: 60.0, fy: 60.0, cx: 31.5, cy: 23.5, width: 640, height: 480 };
        let camera = Camera { intrinsics, distortion: Distortion::None };
        let given =
            Options { method: Method::Given(Box::new(KnownCamera::exact(camera))), ..options() };
        let error = audit(&open(files()), &given).expect_err("another size");
        assert!(
            matches!(&error, Error::CameraSize(e) if (e.given, e.size) == ([640, 480], [64, 48])),
            "{error}"
        );
    }

    #[test]
    fn progress_counts_every_step_once() {
        let seen = Mutex::new(Vec::new());
        audit_observed(&open(files()), &options(), &|p| seen.lock().expect("no panic").push(p))
            .expect("an audit");
        let mut steps = seen.into_inner().expect("no panic");
        steps.sort_by_key(|p| (p.stage, p.done));
        let count =
            |stage| steps.iter().filter(|p| p.stage == stage).map(|p| p.done).collect::<Vec<_>>();
        assert_eq!(count(Stage::Detect), [0, 1, 2, 3]);
        assert_eq!(count(Stage::Calibrate), [0, 1]);
        assert_eq!(count(Stage::Judge), [0, 1]);
    }
}
