//! The same optimum as OpenCV's, the same σ as mrcal's.

use super::{
    FrameCorners, Input, Method, Model, calibrate,
    fit::{Data, Start, Wanted, fit},
    problem::Measured,
    surface::{Sheet, Surface},
    views::all_usable,
};
use crate::{
    board::CharucoBoard,
    camera::{Distortion, Intrinsics},
    detect::Corner,
    geom::Pixel,
    pose::Weighting,
    solve::Loss,
};

/// Corners and calibrations of `tests/golden/opencv/calibrate.py`.
const GOLDEN: &str = include_str!("../../tests/golden/opencv/calibrate.json");

/// Covariance and projection uncertainty by `tests/golden/mrcal/mrcal_uncertainty.py`.
const MRCAL: &str = include_str!("../../tests/golden/mrcal/mrcal.json");

fn number(value: &serde_json::Value) -> f64 {
    value.as_f64().unwrap()
}

fn numbers(value: &serde_json::Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(number).collect()
}

/// What both programs were given.
fn given(golden: &serde_json::Value) -> (Intrinsics, CharucoBoard, Vec<FrameCorners>) {
    let [fx, fy, cx, cy] = ["fx", "fy", "cx", "cy"].map(|key| number(&golden["factory"][key]));
    let factory = Intrinsics { fx, fy, cx, cy, width: 640, height: 480 };
    let board = CharucoBoard::paper(number(&golden["square_m"])).unwrap();
    let frames: Vec<FrameCorners> = golden["views"]
        .as_array()
        .unwrap()
        .iter()
        .enumerate()
        .map(|(frame, corners)| {
            let corners = corners.as_array().unwrap().iter().map(|corner| Corner {
                id: corner[0].as_u64().unwrap() as usize,
                pixel: Pixel::new(number(&corner[1]), number(&corner[2])),
                sigma_px: 0.2,
            });
            FrameCorners { frame, corners: corners.collect() }
        })
        .collect();
    (factory, board, frames)
}

#[test]
fn same_optimum_as_opencv() {
    let golden: serde_json::Value = serde_json::from_str(GOLDEN).unwrap();
    let (factory, board, frames) = given(&golden);
    let (fx, fy) = (factory.fx, factory.fy);
    let input = Input { board: &board, factory: &factory, tables: None, frames: &frames };
    for model in [Model::Focal, Model::FocalCentre, Model::Brown] {
        let theirs = &golden["models"][model.name()];
        let ours = calibrate(&input, Method::Plain(model)).unwrap();
        let name = model.name();
        let close = |what: &str, ours: f64, tolerance: f64| {
            let theirs = number(&theirs[what]);
            assert!((ours - theirs).abs() <= tolerance, "{name} {what}: {ours}, OpenCV {theirs}");
        };
        assert_eq!(ours.views.len(), frames.len());
        close("rms_px", ours.rms_px, 1e-6);
        let pinhole = ours.camera.intrinsics;
        close("fx", pinhole.fx, 1e-5 * fx);
        close("fy", pinhole.fy, 1e-5 * fy);
        close("cx", pinhole.cx, 1e-3);
        close("cy", pinhole.cy, 1e-3);
        if let Distortion::Brown(lens) = ours.camera.distortion {
            close("k1", lens.k1, 1e-4);
            close("k2", lens.k2, 1e-3);
            close("p1", lens.p1, 1e-5);
            close("p2", lens.p2, 1e-5);
            close("k3", lens.k3, 3e-3);
        } else {
            assert!(model != Model::Brown);
        }
        // An optimum: no worse than theirs to far below what both print.
        assert!(
            ours.rms_px <= number(&theirs["rms_px"]) + 1e-9,
            "{name}: {} {theirs}",
            ours.rms_px
        );
    }
}

/// The optimum, the σ of all intrinsics and the projection's uncertainty over the image, for independent corner noise.
#[test]
fn same_sigmas_as_mrcal() {
    let golden: serde_json::Value = serde_json::from_str(GOLDEN).unwrap();
    let mrcal: serde_json::Value = serde_json::from_str(MRCAL).unwrap();
    let (factory, board, frames) = given(&golden);
    let input = Input { board: &board, factory: &factory, tables: None, frames: &frames };
    let gathered = all_usable(&input, 4, Weighting::Equal);
    let views: Vec<&Measured> = gathered.views.iter().collect();
    let poses: Vec<_> = views.iter().map(|v| v.pose).collect();
    let shape = Model::BrownAspect.shape(None, Surface::Flat).unwrap();
    let data = Data {
        factory: &factory,
        views: &views,
        // One picture has nobody to disagree with: what is left is the classical covariance.
        pictures: &vec![0; views.len()],
        loss: Loss::Squared,
        sheet: &Sheet::new(&board),
        cost_tolerance: 1e-14,
        wanted: Wanted::Everything,
    };
    let free = shape.start(&factory);
    let found = fit(shape, &data, Start { free: &free, knots_m: &[], poses: &poses }).unwrap();

    let mut calibration = calibrate(&input, Method::Plain(Model::BrownAspect)).unwrap();
    let n_corners = calibration.n_corners() as f64;
    let squares = calibration.rms_px.powi(2) * n_corners;
    let noise_px = (squares / (2.0 * n_corners - 9.0 - 6.0 * views.len() as f64)).sqrt();

    let theirs = numbers(&mrcal["intrinsics"]);
    let sigmas = numbers(&mrcal["sigma_per_px"]);
    // Theirs is fx fy cx cy k1..., ours fx cx cy k1... fy/fx.
    for (ours, theirs_at) in [(0, 0), (1, 2), (2, 3), (3, 4), (4, 5), (5, 6), (6, 7), (7, 8)] {
        let estimate = found.estimate(ours);
        let off = (estimate.value - theirs[theirs_at]) / estimate.sigma;
        assert!(off.abs() < 1e-3, "{ours}: {estimate:?} {theirs:?}");
        let ratio = estimate.sigma / (noise_px * sigmas[theirs_at]);
        assert!((ratio - 1.0).abs() < 1e-3, "{ours}: {ratio}");
    }

    let grid = &mrcal["grid"];
    let size = |name: &str| grid[name].as_u64().unwrap() as usize;
    calibration.motion = found.motion;
    let ours = calibration
        .projection_uncertainty(size("columns"), size("rows"), number(&grid["depth_m"]))
        .unwrap();
    let theirs = numbers(&grid["sigma_px_per_px"]);
    assert_eq!(ours.sigma_px.len(), theirs.len());
    for ((ours, theirs), pixel) in ours.sigma_px.iter().zip(theirs).zip(&ours.pixels) {
        let ratio = ours / (noise_px * theirs);
        assert!((ratio - 1.0).abs() < 0.01, "{pixel:?}: {ratio}");
    }
}
