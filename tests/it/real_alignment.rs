//! Depth against colour on the published recordings, as they are and warped.

use std::{fs, sync::Arc};

use truedepth::{
    audit::{Audit, Method, Options, audit},
    depth::Registration,
    diagnose::{Code, Verdict},
    image::DepthMap,
    recording::{Limits, Memory, Recording, encode_depth},
};

use crate::data;

const RECORDINGS: [&str; 3] = [
    "zeiss/FrontCamCalibrationDataset/iPhone11Pro_iOS14",
    "zeiss/FrontCamCalibrationDataset/iPadPro12_4gen_iOS15",
    "zeiss/FrontCamCalibrationDataset/iPadPro12_5gen_iOS15",
];

fn run(recording: &Recording) -> Audit {
    audit(recording, &Options::new(Method::Auto)).expect("audits")
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
        assert!((5e-5..3e-4).contains(&print.contrast_m.value), "{name}: {print:?}");
        let apart = found.disagreement.expect("two witnesses");
        assert!(apart < 2.6, "{name}: {apart}"); // 5 % of right σ are beyond.
        let verdict = |code: Code| {
            audit.findings.iter().find(|f| f.code == code).expect("is checked").verdict
        };
        assert_eq!(verdict(Code::TD401), Verdict::Ok, "{name}");
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

/// The depth map that shows the window of this size about the principal point, nearest measurement.
fn warped(map: &DepthMap, zoom: f64, [cx, cy]: [f64; 2]) -> DepthMap {
    let (width, height) = (map.width(), map.height());
    let from = |q: usize, c: f64| (c + zoom * (q as f64 - c)).round();
    let depth_m = (0..width * height)
        .map(|i| {
            let (x, y) = (from(i % width, cx), from(i / width, cy));
            if x < 0.0 || y < 0.0 { f32::NAN } else { map.at(x as usize, y as usize) }
        })
        .collect();
    DepthMap::new(width, height, depth_m)
}

/// The paper's first issue, made from a recording that does not have it.
#[test]
fn a_warped_recording_tells_by_how_much() {
    for (name, zoom) in [(RECORDINGS[0], 1.0 / 0.9507), (RECORDINGS[1], 0.9507)] {
        let Some(path) = data(name) else { return };
        let recording = Recording::open(&path, &Limits::default()).expect("opens");
        let factory = recording.factory().expect("metadata").intrinsics;
        let mut files = Memory::new("warped");
        for entry in fs::read_dir(&path).expect("lists") {
            let entry = entry.expect("lists");
            let name = entry.file_name().into_string().expect("a plain name");
            files.insert(name, fs::read(entry.path()).expect("reads"));
        }
        for (index, frame) in recording.frames.iter().enumerate() {
            let Some(file) = &frame.depth else { continue };
            let map = recording.depth(index).expect("decodes");
            let png = encode_depth(&warped(&map, zoom, [factory.cx, factory.cy]));
            assert!(files.get(file).is_some(), "{file} is replaced, not added");
            files.insert(file.clone(), png);
        }
        let after = Recording::from_source(Arc::new(files), &Limits::default()).expect("opens");
        let (before, after) = (run(&recording), run(&after));
        let change = registration(&after).zoom.value / registration(&before).zoom.value;
        let percent = 100.0 * (change.max(1.0 / change) - 1.0);
        assert!((percent - 5.186).abs() < 0.5, "{name}: {percent} %");
        assert_eq!(change > 1.0, zoom > 1.0);
        let finding = after.findings.iter().find(|f| f.code == Code::TD401).expect("is checked");
        assert_eq!(finding.verdict, Verdict::Fault, "{finding:?}");
    }
}
