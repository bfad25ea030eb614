//! The same optimum as OpenCV's.

use super::{FrameCorners, Input, Method, Model, calibrate};
use crate::{
    board::CharucoBoard,
    camera::{Distortion, Intrinsics},
    detect::Corner,
    geom::Pixel,
};

/// Corners and calibrations of `tests/golden/opencv/calibrate.py`.
const GOLDEN: &str = include_str!("../../tests/golden/opencv/calibrate.json");

#[test]
fn same_optimum_as_opencv() {
    let golden: serde_json::Value = serde_json::from_str(GOLDEN).unwrap();
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
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
