//! Depth against colour on the published recordings, as they are and warped.

use std::sync::Arc;

use truedepth::{
    audit::{Audit, Options, audit},
    depth::Registration,
    diagnose::{Code, Verdict, depth_state},
    files::{Limits, Memory},
    geom::Pixel,
    image::DepthMap,
    measure::{Method, Silent},
    recording::{FrameImage, Recording, StreamState, encode_depth},
};

use crate::data;

const RECORDINGS: [&str; 3] = [
    "zeiss/FrontCamCalibrationDataset/iPhone11Pro_iOS14",
    "zeiss/FrontCamCalibrationDataset/iPadPro12_4gen_iOS15",
    "zeiss/FrontCamCalibrationDataset/iPadPro12_5gen_iOS15",
];

fn run(recording: &Recording) -> Audit {
    audit(recording, &Options::new(Method::Auto), &Silent).expect("audits")
}

fn registration(audit: &Audit) -> &Registration {
    audit.registration.as_ref().expect("depth on the board in many frames")
}

/// These were made through AVFoundation, where the paper saw no misalignment.
#[test]
fn av_foundation_is_aligned() {
    for name in RECORDINGS {
        let Some(path) = data(name) else { return };
        let audit = run(&Recording::open(&path, &Limits::default()).expect("opens"));
        let found = registration(&audit);
        assert!((found.zoom.value - 1.0).abs() < 0.008, "{name}: {:?}", found.zoom);
        assert!(found.zoom.sigma < 0.004, "{name}: {:?}", found.zoom);
        // Two witnesses that share nothing but the poses.
        let print = found.imprint.as_ref().expect("stands out in all three");
        assert!((1.5e-4..4e-4).contains(&print.contrast_m.value), "{name}: {print:?}");
        let apart = found.disagreement.expect("two witnesses");
        assert!(apart < 2.6, "{name}: {apart}"); // 5 % of right σ are beyond.
        let verdict = |code: Code| {
            audit.findings.iter().find(|f| f.code == code).expect("is checked").verdict
        };
        // The 5th generation's frames are few and blurred: 0.994 ± 0.003 leaves open whether 1 % is exceeded.
        let known = if name.contains("5gen") { Verdict::Unknown } else { Verdict::Ok };
        assert_eq!(verdict(Code::TD401), known, "{name}");
        assert_ne!(verdict(Code::TD403), Verdict::Fault, "{name}");
        let [x, y] = found.shift_px;
        assert!(y.value.abs() < 3.0 * y.sigma, "{name}: {y:?}");
        // The iPhone's depth does lie right of its colour: docs/method/alignment.md.
        if name.contains("iPhone") {
            for x in [x, print.shift_px[0], found.slopes.shift_px[0]] {
                assert!(x.value > 3.0 * x.sigma && (0.7..2.3).contains(&x.value), "{x:?}");
            }
            assert_eq!(verdict(Code::TD402), Verdict::Fault);
        } else {
            assert!(x.value.abs() < 3.0 * x.sigma, "{name}: {x:?}");
            assert_ne!(verdict(Code::TD402), Verdict::Fault, "{name}");
        }
        let handedness = audit.handedness.expect("poses");
        assert_eq!(handedness.n_mirrored, 0, "{name}: {handedness:?}");
        assert!(handedness.n_straight >= 5, "{name}: {handedness:?}");
    }
}

/// The recording with other depth maps: each pixel holds the measurement nearest to where `from` sends it.
fn moved(recording: &Recording, from: impl Fn(Pixel) -> Option<Pixel>) -> Recording {
    let mut files = Memory::new("moved");
    for name in recording.file_names() {
        files.insert(name, recording.file(name).expect("reads"));
    }
    for (index, frame) in recording.frames.iter().enumerate() {
        let Some(FrameImage { file, .. }) = &frame.depth else { continue };
        let map = recording.depth(index).expect("decodes");
        let width = map.width();
        let depth_m = (0..width * map.height())
            .map(|i| {
                let at = from(Pixel::new((i % width) as f64, (i / width) as f64));
                let Some(Pixel { x, y }) = at.filter(|at| at.x > -0.5 && at.y > -0.5) else {
                    return f32::NAN;
                };
                map.at(x.round() as usize, y.round() as usize)
            })
            .collect();
        assert!(files.get(file).is_some(), "{file} is replaced, not added");
        files.insert(file.clone(), encode_depth(&DepthMap::new(width, map.height(), depth_m)));
    }
    Recording::from_files(Arc::new(files), &Limits::default()).expect("opens")
}

/// Every second frame against the others: each half calibrates for itself. With ten frames to a half an honest σ²
/// still scatters, and the mean square of errors over σ is ν/(ν−2), 1.3 for eight degrees of freedom; nine of these
/// are below 4.1 on average in 99.9 % of cases. (Of 40 random halves of each recording the mean is 1.5, and the mean
/// square of errors over that of σ 1.2.)
#[test]
fn halves_agree() {
    let mut squares = Vec::new();
    for name in RECORDINGS {
        let Some(path) = data(name) else { return };
        let recording = Recording::open(&path, &Limits::default()).expect("opens");
        let half = |odd: usize| {
            let left_out = recording.frames.iter().enumerate().filter(|(i, _)| i % 2 != odd);
            let left_out: Vec<&str> = left_out
                .flat_map(|(_, f)| f.color.iter().chain(&f.depth))
                .map(|image| image.file.as_str())
                .collect();
            let mut files = Memory::new("half");
            for name in recording.file_names() {
                if !left_out.contains(&name) {
                    files.insert(name, recording.file(name).expect("reads"));
                }
            }
            run(&Recording::from_files(Arc::new(files), &Limits::default()).expect("opens"))
        };
        let (even, odd) = (half(0), half(1));
        let (even, odd) = (registration(&even), registration(&odd));
        let [[ax, ay], [bx, by]] = [even.shift_px, odd.shift_px];
        for (a, b) in [(even.zoom, odd.zoom), (ax, bx), (ay, by)] {
            let z = (a.value - b.value) / a.sigma.hypot(b.sigma);
            assert!(z.abs() < 4.0, "{name}: {a:?} {b:?}");
            squares.push(z * z);
        }
    }
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    assert!(mean < 4.1, "{mean}: {squares:?}");
}

/// The paper's first issue, made from a recording that does not have it.
#[test]
fn a_warped_recording_tells_by_how_much() {
    for (name, zoom) in [(RECORDINGS[0], 1.0 / 0.9507), (RECORDINGS[1], 0.9507)] {
        let Some(path) = data(name) else { return };
        let recording = Recording::open(&path, &Limits::default()).expect("opens");
        let factory = recording.factory().expect("metadata").intrinsics;
        let after = moved(&recording, |q| {
            let from = |q: f64, c: f64| c + zoom * (q - c);
            Some(Pixel::new(from(q.x, factory.cx), from(q.y, factory.cy)))
        });
        let (before, after) = (run(&recording), run(&after));
        let change = registration(&after).zoom.value / registration(&before).zoom.value;
        let percent = 100.0 * (change.max(1.0 / change) - 1.0);
        assert!((percent - 5.186).abs() < 0.5, "{name}: {percent} %");
        assert_eq!(change > 1.0, zoom > 1.0);
        let finding = after.findings.iter().find(|f| f.code == Code::TD401).expect("is checked");
        assert_eq!(finding.verdict, Verdict::Fault, "{finding:?}");
    }
}

/// Depth distorted as the lens would, beside colour that is rectified: nobody records that, and who resamples colour
/// alone makes it.
#[test]
fn distorted_depth_beside_rectified_colour_is_told() {
    let Some(path) = data(RECORDINGS[2]) else { return };
    let recording = Recording::open(&path, &Limits::default()).expect("opens");
    let tables = recording.factory().and_then(|f| f.tables.clone()).expect("tables");
    let before = run(&recording);
    let after = run(&moved(&recording, |q| tables.undistort(q)));
    for (audit, whole) in [(&before, 0.0), (&after, 1.0)] {
        let share = registration(audit).lens_share.expect("there are tables");
        assert!((share.value - whole).abs() < 2.0 * share.sigma && share.sigma < 0.25, "{share:?}");
        assert_eq!(audit.distortion_state, StreamState::Rectified);
        let told = depth_state(StreamState::Rectified, Some(share));
        assert_eq!(audit.depth_distortion_state, told, "{share:?}");
        let finding = audit.findings.iter().find(|f| f.code == Code::TD203).expect("is checked");
        let warned = finding.verdict == Verdict::Warning;
        assert_eq!(warned, told == StreamState::Distorted, "{finding:?}");
    }
    assert_eq!(before.depth_distortion_state, StreamState::Rectified);
    // 0.77 ± 0.17: most of the way, and not beyond doubt.
    assert_ne!(after.depth_distortion_state, StreamState::Rectified);
}
