//! Calibrations of real recordings: what issue 4 asks to be shown.

use std::fs;

use truedepth::{
    board::CharucoBoard,
    calibrate::{
        Calibration, FrameCorners, Input, Method, Model, SurfaceKind, calibrate, guess_intrinsics,
    },
    camera::Intrinsics,
    detect::Detector,
    files::Limits,
    image::{Gray, Limits as ImageLimits},
    recording::Recording,
};

use crate::data;

const IPHONE: &str = "zeiss/FrontCamCalibrationDataset/iPhone11Pro_iOS14";
const IPAD4: &str = "zeiss/FrontCamCalibrationDataset/iPadPro12_4gen_iOS15";
const IPAD5: &str = "zeiss/FrontCamCalibrationDataset/iPadPro12_5gen_iOS15";

/// A recording's corners, found once.
struct Seen {
    recording: Recording,
    board: CharucoBoard,
    frames: Vec<FrameCorners>,
}

impl Seen {
    fn new(name: &str) -> Option<Self> {
        let recording = Recording::open(data(name)?, &Limits::default()).expect("opens");
        let board = recording.board.clone().expect("checkersize.txt");
        let detector = Detector::new(&board);
        let frames = (0..recording.frames.len())
            .filter(|i| recording.frames[*i].color.is_some())
            .map(|frame| {
                let image = recording.gray(frame).expect("decodes");
                FrameCorners { frame, corners: detector.detect(&image).corners }
            })
            .filter(|f| !f.corners.is_empty())
            .collect();
        Some(Self { recording, board, frames })
    }

    fn factory(&self) -> &Intrinsics {
        &self.recording.factory().expect("metadata").intrinsics
    }

    fn calibrate(&self, method: Method) -> Calibration {
        let tables = self.recording.factory().and_then(|f| f.tables.as_ref());
        let (board, factory) = (&self.board, self.factory());
        calibrate(&Input { board, factory, tables, frames: &self.frames }, method)
            .expect("determined")
    }
}

/// RMS over the views that the shutter did not smear: the median σ of their corners is below 0.025 px.
fn sharp_rms_px(calibration: &Calibration) -> f64 {
    let (mut squares, mut n) = (0.0, 0);
    for view in &calibration.views {
        let mut sigmas: Vec<f64> = view.corners.iter().map(|c| c.sigma_px).collect();
        sigmas.sort_by(f64::total_cmp);
        if sigmas[sigmas.len() / 2] < 0.025 {
            squares += view.rms_px.powi(2) * view.corners.len() as f64;
            n += view.corners.len();
        }
    }
    (squares / n as f64).sqrt()
}

/// Half a pixel and more for a flat board, a sixth of one for the board as it is; the same board in three recordings
/// by three devices; focal lengths and centres where they belong.
#[test]
fn the_board_as_it_is() {
    // All frames, blurred ones with them: 0.170, 0.186 and 0.211 px were measured; sharp ones 0.170, 0.157, 0.166.
    let cases = [(IPHONE, 0.20), (IPAD4, 0.20), (IPAD5, 0.22)];
    let mut surfaces = Vec::new();
    for (name, all_px) in cases {
        let Some(seen) = Seen::new(name) else { return };
        let found = seen.calibrate(Method::Auto);
        let [flat, bend, free] = &found.surfaces[..] else { panic!("{:?}", found.surfaces) };
        assert!(flat.rms_px > 0.33 && flat.behind_best_sigmas > 5.0, "{name} {flat:?}");
        assert!(bend.behind_best_sigmas > 5.0 && free.behind_best_sigmas == 0.0, "{name}");
        assert!(found.rms_px <= all_px, "{name}: {} px", found.rms_px);
        assert!(sharp_rms_px(&found) <= 0.18, "{name}: {} px", sharp_rms_px(&found));
        let surface = found.surface.clone().expect("not flat");
        assert_eq!(surface.kind, SurfaceKind::Free);
        let size = surface.size_m();
        assert!((size.value - 0.00085).abs() < 3.0 * size.sigma.max(2e-5), "{name} {size:?}");
        let difference = found.focal_px().value / seen.factory().fx - 1.0;
        match name {
            IPHONE => assert!(difference.abs() < 0.008, "{difference}"),
            IPAD5 => assert!((-0.066..-0.057).contains(&difference), "{difference}"),
            _ => {
                assert!(found.model.uses_table(), "{:?}", found.model);
                assert!(difference.abs() < 0.003, "{difference}");
            }
        }
        let [a, b] = found.split_half_focal_px.expect("two halves");
        assert!((a.value - b.value).abs() < 2.0 * a.sigma.hypot(b.sigma), "{name} {a:?} {b:?}");
        let focal = found.focal_px();
        for left_out in &found.left_out {
            assert!((left_out.focal_px - focal.value).abs() < 2.0 * focal.sigma, "{left_out:?}");
        }
        surfaces.push((name, surface));
    }
    // The comparison: z² of heights averages 1 where σ are right; correlated errors of neighbours widen that. 0.95 was
    // measured between the iPads, which saw the sheet under one light; 1.8 and 2.3 to the iPhone, which saw it under
    // another: there the taped paper is twisted by 0.07 mm more (docs/method/calibrate.md).
    for (i, (a, one)) in surfaces.iter().enumerate() {
        for (b, other) in &surfaces[..i] {
            let n = one.heights_m.len() as f64;
            let (mut z2, mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0, 0.0);
            for id in 0..one.heights_m.len() {
                let (h, g) = (one.heights_m[id], other.heights_m[id]);
                z2 += ((h - g) / one.sigmas_m[id].hypot(other.sigmas_m[id])).powi(2) / n;
                (ab, aa, bb) = (ab + h * g, aa + h * h, bb + g * g);
            }
            assert!(ab / (aa * bb).sqrt() > 0.975, "{a} and {b}: {}", ab / (aa * bb).sqrt());
            println!("{a} and {b}: z² {z2:.2}");
            let same_day = ![a, b].contains(&&IPHONE);
            assert!(z2 < if same_day { 1.4 } else { 2.6 }, "{a} and {b}: {z2}");
        }
    }
}

/// With table or free distortion the 4th generation's factory values are right.
#[test]
fn ipad_4th_generation_agrees_with_its_factory() {
    let Some(seen) = Seen::new(IPAD4) else { return };
    for model in [Model::FocalTableCentre, Model::Brown] {
        let found = seen.calibrate(Method::Robust(model));
        let pinhole = &found.camera.intrinsics;
        assert!((pinhole.fx / 595.34 - 1.0).abs() < 0.0025, "{model:?}: {}", pinhole.fx);
        let off = (pinhole.cx - 318.33).hypot(pinhole.cy - 239.96);
        assert!(off < 1.5, "{model:?}: {pinhole:?}");
    }
}

/// A RealSense of which nothing is told but images, against the intrinsics its owner published: those of
/// `calibrateCamera` with fx, fy, centre and five distortion coefficients free, on a board taken for flat and printed
/// true. Under these assumptions they come out; but the paper print is curled by 1.2 mm and stretched by 0.3 %, and
/// without that the pixels are square.
#[test]
fn realsense_from_images_alone() {
    let Some(folder) = data("realsense-handeye/intrinsics_gray") else { return };
    let board: CharucoBoard = "7x5:30mm:21mm:4X4_50".parse().expect("a board");
    let detector = Detector::new(&board);
    let mut files: Vec<_> =
        fs::read_dir(folder).expect("lists").map(|f| f.expect("entry").path()).collect();
    files.sort();
    let frames: Vec<FrameCorners> = files
        .iter()
        .enumerate()
        .map(|(frame, file)| {
            let bytes = fs::read(file).expect("reads");
            let image = Gray::decode(&bytes, &ImageLimits::default()).expect("decodes");
            FrameCorners { frame, corners: detector.detect(&image).corners }
        })
        .collect();
    let guess = guess_intrinsics(&board, &frames, [1280, 720]);
    let input = Input { board: &board, factory: &guess, tables: None, frames: &frames };
    let plain = calibrate(&input, Method::Plain(Model::BrownAspect)).expect("determined");
    let sigma = |found: &Calibration, name: &str| found.parameter(name).expect("free").sigma;
    let pinhole = &plain.camera.intrinsics;
    let fy_sigma = sigma(&plain, "focal_px").hypot(pinhole.fx * sigma(&plain, "aspect"));
    for (what, ours, published, sigma) in [
        ("fx", pinhole.fx, 898.29, sigma(&plain, "focal_px")),
        ("fy", pinhole.fy, 901.07, fy_sigma),
        ("cx", pinhole.cx, 649.37, sigma(&plain, "center_x_px")),
        ("cy", pinhole.cy, 362.53, sigma(&plain, "center_y_px")),
    ] {
        let off = (ours - published).abs();
        println!("{what}: {ours:.2} ± {sigma:.2}, published {published}");
        assert!(off < 0.001 * published || off < sigma, "{what}: {ours} ± {sigma}, {published}");
    }
    let found = calibrate(&input, Method::Robust(Model::BrownAspect)).expect("determined");
    assert!(found.rms_px < 0.2 && plain.rms_px > 0.6, "{} {}", found.rms_px, plain.rms_px);
    let aspect = found.parameter("aspect").expect("free");
    assert!((aspect.value - 1.0).abs() < 3.0 * aspect.sigma && aspect.sigma < 0.001, "{aspect:?}");
    let [stretch, _] = found.surface.and_then(|s| s.print).expect("free");
    assert!((stretch.value + 0.003).abs() < 4.0 * stretch.sigma, "{stretch:?}");
}
