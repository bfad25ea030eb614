//! Whole audits of recordings in memory.

use std::sync::{Arc, Mutex};

use super::*;
use crate::{
    calibrate::KnownCamera,
    camera::{Camera, Distortion, Intrinsics},
    files::{Limits, Memory},
    image::{DepthMap, Rgb},
    measure::{FrameMeasurement, Progress, Silent, Stage},
    recording::{Factory, Writer},
};

/// Grey images without a board.
fn files() -> Memory {
    let intrinsics = Intrinsics { fx: 60.0, fy: 60.0, cx: 31.5, cy: 23.5, width: 64, height: 48 };
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
    Recording::from_files(Arc::new(files), &Limits::default()).expect("opens")
}

fn options() -> Options {
    let board = CharucoBoard::paper(0.020875).expect("a board");
    Options { board: Some(board), ..Options::new(Method::Auto) }
}

#[test]
fn no_board_in_any_frame_is_no_error() {
    let audit = audit(&open(files()), &options(), &Silent).expect("an audit");
    assert_eq!(audit.n_frames_with_board(), 0);
    assert!(!audit.has_faults() && audit.calibration.is_none() && audit.camera.is_none());
    assert!(audit.measured.no_calibration.expect("a reason").contains("not seen in any frame"));
    assert_eq!(audit.distortion_state, StreamState::Unknown);
    for finding in audit.findings.iter().filter(|f| f.verdict == Verdict::Unknown) {
        assert!(!finding.what_to_do.is_empty(), "{finding:?}");
    }
    let unknown = audit.findings.iter().filter(|f| f.verdict == Verdict::Unknown).count();
    assert!(unknown >= 5, "{unknown}");
}

#[test]
fn no_board_known() {
    let error = audit(&open(files()), &Options::new(Method::Auto), &Silent).expect_err("no board");
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
    let error = audit(&open(cut), &options(), &Silent).expect_err("half an image");
    assert!(error.to_string().contains("rgb_600.png"), "{error}");
}

#[test]
fn a_camera_of_another_size() {
    let intrinsics = Intrinsics { fx: 60.0, fy: 60.0, cx: 31.5, cy: 23.5, width: 640, height: 480 };
    let camera = Camera { intrinsics, distortion: Distortion::None };
    let given =
        Options { method: Method::Given(Box::new(KnownCamera::exact(camera))), ..options() };
    let error = audit(&open(files()), &given, &Silent).expect_err("another size");
    assert!(
        matches!(&error, Error::CameraSize(e) if (e.given, e.size) == ([640, 480], [64, 48])),
        "{error}"
    );
}

#[test]
fn progress_counts_every_step_once() {
    #[derive(Default)]
    struct Counts(Mutex<Vec<Progress>>, Mutex<Vec<usize>>);

    impl Observer for Counts {
        fn progress(&self, progress: Progress) {
            self.0.lock().expect("no panic").push(progress);
        }

        fn begins(&self, frame: usize) -> bool {
            frame == 1
        }

        fn looked(&self, frame: usize, found: &FrameMeasurement, image: Option<&Rgb>) {
            assert_eq!(found.n_corners, 0);
            if image.is_some() {
                self.1.lock().expect("no panic").push(frame);
            }
        }
    }

    let counts = Counts::default();
    audit(&open(files()), &options(), &counts).expect("an audit");
    assert_eq!(counts.1.into_inner().expect("no panic"), [1], "the image that was wanted");
    let mut steps = counts.0.into_inner().expect("no panic");
    steps.sort_by_key(|p| (p.stage, p.done));
    let count =
        |stage| steps.iter().filter(|p| p.stage == stage).map(|p| p.done).collect::<Vec<_>>();
    assert_eq!(count(Stage::Detect), [0, 1, 2, 3]);
    assert_eq!(count(Stage::Calibrate), [0, 1]);
    assert_eq!(count(Stage::Judge), [0, 1]);
}
