//! The whole room on corners of known cameras.

use super::{
    Calibration, Error, Estimate, FrameCorners, Input, Lens, Method, Model, Rejection, calibrate,
    synthetic::{FACTORY, Random, Scene, board, pose, tables},
};
use crate::{
    camera::{Brown, Distortion, TablePair},
    solve::mean,
};

fn run(
    frames: &[FrameCorners],
    tables: Option<&TablePair>,
    method: Method,
) -> Result<Calibration, Error> {
    calibrate(&Input { board: &board(), factory: &FACTORY, tables, frames }, method)
}

fn normalised(estimate: Estimate, truth: f64) -> f64 {
    (estimate.value - truth) / estimate.sigma
}

/// Sixty calibrations: errors in their own σ have unit variance, the focal length has no bias.
#[test]
fn sigmas_are_honest() {
    const N: u64 = 60;
    let scene = Scene::new(Distortion::None);
    let truth = scene.camera.intrinsics;
    let (mut squares, mut errors) = ([0.0; 3], Vec::new());
    for seed in 0..N {
        let found = run(&scene.frames(seed), None, Method::Robust(Model::FocalCentre)).unwrap();
        let names = [("focal_px", truth.fx), ("center_x_px", truth.cx), ("center_y_px", truth.cy)];
        for (sum, (name, truth)) in squares.iter_mut().zip(names) {
            *sum += normalised(found.parameter(name).unwrap(), truth).powi(2) / N as f64;
        }
        errors.push(found.focal_px().value / truth.fx - 1.0);
    }
    // A mean of 60 squares scatters by √(2/60) = 0.18. Taking the larger of two σ errs to the safe side: below 1.
    for variance in squares {
        assert!(variance > 0.45 && variance < 1.4, "{squares:?}");
    }
    let bias = mean(&errors);
    assert!(bias.abs() < 2e-4, "{bias}");
}

/// The same on boards that are not flat, each its own way: residuals of a view are correlated, and σ must know.
#[test]
fn sigmas_know_of_wavy_boards() {
    const N: u64 = 40;
    let scene = Scene { wave_m: 4e-4, noise_px: 0.03, ..Scene::new(Distortion::None) };
    let mut variance = 0.0;
    for seed in 0..N {
        let found = run(&scene.frames(seed), None, Method::Robust(Model::FocalCentre)).unwrap();
        variance += normalised(found.focal_px(), scene.camera.intrinsics.fx).powi(2) / N as f64;
    }
    assert!(variance < 2.0, "{variance}");
}

#[test]
fn order_of_frames_does_not_matter() {
    let mut frames = Scene::new(Distortion::None).frames(5);
    let first = run(&frames, None, Method::Auto).unwrap();
    frames.reverse();
    frames[3].corners.reverse();
    let second = run(&frames, None, Method::Auto).unwrap();
    assert_eq!(format!("{first:?}"), format!("{second:?}"));
    // Other names for the frames: the same but for the order of sums.
    for (index, frame) in frames.iter_mut().enumerate() {
        frame.frame = index;
    }
    let third = run(&frames, None, Method::Auto).unwrap();
    assert!((first.focal_px().value - third.focal_px().value).abs() < 1e-3);
    assert!((first.focal_px().sigma / third.focal_px().sigma - 1.0).abs() < 1e-3);
}

/// The model that made the corners is chosen, the simplest where several did.
#[test]
fn chooses_the_model() {
    let tables = tables();
    let lens = Brown { k1: 0.08, k2: -0.1, p1: 0.002, p2: -0.002, k3: 0.0 };
    let cases = [
        (Distortion::None, vec![Model::FocalCentre]),
        (Distortion::Table(tables.clone()), vec![Model::FocalTableCentre]),
        (Distortion::Brown(lens), vec![Model::Brown]),
    ];
    for (distortion, expected) in cases {
        let mut n = 0;
        for seed in 0..6 {
            let scene = Scene { n_views: 20, ..Scene::new(distortion.clone()) };
            let found = run(&scene.frames(seed), Some(&tables), Method::Auto).unwrap();
            n += usize::from(expected.contains(&found.model));
            assert!(normalised(found.focal_px(), 531.0).abs() < 4.0, "{found:?}");
            assert_eq!(found.candidates.len(), 5);
            let [a, b] = found.split_half_focal_px.unwrap();
            assert!((a.value - b.value).abs() < 4.0 * a.sigma.hypot(b.sigma));
        }
        assert!(n >= 5, "{expected:?} in {n} of 6");
    }
}

#[test]
fn tells_how_distorted_the_stream_is() {
    let tables = tables();
    let twice = TablePair { forward: tables.inverse.clone(), inverse: tables.forward.clone() };
    let cases = [
        (Distortion::None, 0.0, Lens::None),
        (Distortion::Table(tables.clone()), 1.0, Lens::InverseTable),
        (Distortion::Table(twice), -1.0, Lens::ForwardTable),
    ];
    for (distortion, amplitude, lens) in cases {
        let frames = Scene::new(distortion).frames(11);
        let test = run(&frames, Some(&tables), Method::Auto).unwrap().distortion.unwrap();
        let found = test.amplitude.unwrap();
        assert!(normalised(found, amplitude).abs() < 3.5, "{amplitude}: {found:?}");
        assert!(found.sigma < 0.1);
        let whole = test.table_corner_shift_px.unwrap();
        assert!((whole - 0.0099 * tables.inverse.max_radius_px).abs() < 1e-6);
        assert!((test.corner_shift_px.value - found.value * whole).abs() < 1e-9);
        assert!((test.corner_shift_px.sigma - found.sigma * whole).abs() < 1e-6);
        let fixed = [Lens::None, Lens::InverseTable, Lens::ForwardTable];
        let best = test
            .hypotheses
            .iter()
            .filter(|h| fixed.contains(&h.lens))
            .min_by(|a, b| a.rms_px.total_cmp(&b.rms_px))
            .unwrap();
        assert_eq!(best.lens, lens);
    }
    // Without tables, from k1: 0.05·r³ at the corner, r = 0.75.
    let lens = Brown { k1: 0.05, ..Brown::ZERO };
    let scene = Scene::new(Distortion::Brown(lens));
    let test = run(&scene.frames(12), None, Method::Auto).unwrap().distortion.unwrap();
    assert!(test.amplitude.is_none() && test.table_corner_shift_px.is_none());
    assert!(normalised(test.k1, 0.05).abs() < 4.0);
    let truth = {
        let pinhole = scene.camera.intrinsics;
        let corner = [(-0.5 - pinhole.cx) / pinhole.fx, (-0.5 - pinhole.cy) / pinhole.fy];
        let straight = lens.undistort(corner).unwrap();
        531.0 * (corner[0].hypot(corner[1]) - straight[0].hypot(straight[1]))
    };
    assert!(normalised(test.corner_shift_px, truth).abs() < 4.0, "{truth} {test:?}");
    assert!(truth > 5.0 && test.corner_shift_px.sigma < 2.0);
}

/// Views straight on, or all the same, leave the focal length open: that is an error, not a number.
#[test]
fn does_not_invent_a_focal_length() {
    let scene = Scene { n_views: 8, tilt_rad: [0.0, 0.01], ..Scene::new(Distortion::None) };
    for method in [Method::Auto, Method::Robust(Model::Focal), Method::Plain(Model::Focal)] {
        let error = run(&scene.frames(3), None, method).unwrap_err();
        assert!(matches!(error, Error::Underdetermined { .. }), "{method:?} {error}");
        assert!(error.to_string().contains("tilted by 20° to 45°"));
    }
    // One tilted picture, five times over.
    let mut random = Random(1);
    let frames: Vec<FrameCorners> = (0..5)
        .map(|frame| {
            let shake = f64::from(frame as u8) * 1e-3;
            let pose = pose(0.5 + shake, 0.7, 0.1, [0.01 + shake, 0.0, 0.3]);
            FrameCorners { frame, corners: scene.see(&pose, [0.0; 4], &mut random) }
        })
        .collect();
    for method in [Method::Auto, Method::Robust(Model::Focal), Method::Plain(Model::Focal)] {
        let error = run(&frames, None, method).unwrap_err();
        assert!(matches!(error, Error::Underdetermined { n_pictures: 1, .. }), "{method:?}");
    }
    let error = run(&frames, None, Method::Paper).unwrap_err();
    assert!(matches!(error, Error::TooFewViews { n_views: 1, .. }));
    assert!(matches!(run(&[], None, Method::Auto), Err(Error::TooFewViews { n_views: 0, .. })));
    let table = run(&frames, None, Method::Robust(Model::FocalTable));
    assert_eq!(table.unwrap_err(), Error::NoTables { model: Model::FocalTable });
}

#[test]
fn leaves_out_what_disagrees() {
    let scene = Scene::new(Distortion::None);
    let clean = scene.frames(21);
    let mut frames = clean.clone();
    frames[2].corners[7].pixel.x += 3.0;
    frames[9].corners[30].pixel.y -= 40.0;
    for corner in &mut frames[5].corners {
        // Ids of other corners all over.
        corner.id = corner.id * 37 % 63;
    }
    frames[12].corners.truncate(5);
    frames[13].corners.retain(|c| c.id < 9);
    let found = run(&frames, None, Method::Robust(Model::FocalCentre)).unwrap();
    let places: Vec<(usize, usize)> = found.outliers.iter().map(|o| (o.frame, o.id)).collect();
    assert_eq!(
        places,
        [(2, clean[2].corners[7].id), (9, clean[9].corners[30].id)],
        "{:?}",
        found.outliers
    );
    assert!((found.outliers[1].residual_px - 40.0).abs() < 1.0);
    let rejected: Vec<usize> = found.rejected.iter().map(|r| r.frame).collect();
    assert_eq!(rejected, [5, 12, 13]);
    assert!(matches!(found.rejected[0].reason, Rejection::Disagrees { .. }));
    assert!(matches!(found.rejected[1].reason, Rejection::FewCorners { n_corners: 5, needed: 6 }));
    assert!(matches!(
        found.rejected[2].reason,
        Rejection::NarrowCorners { .. } | Rejection::FewCorners { .. }
    ));
    assert!(normalised(found.focal_px(), 531.0).abs() < 4.0);
    assert_eq!(found.views.len(), 12);
}

/// The paper's greedy selection, and nothing free but the focal length.
#[test]
fn selects_as_the_paper() {
    let scene = Scene::new(Distortion::None);
    let mut random = Random(4);
    let mut frames = Vec::new();
    // Camera straight before the board, moved sideways by 3, 5, 8.5, 9 and 12 cm; then tilted views.
    for (frame, x) in [0.0, 0.03, 0.05, 0.085, 0.09, 0.12].into_iter().enumerate() {
        let pose = pose(0.0, 0.0, 0.0, [0.06 - x, 0.0, 0.35]);
        frames.push(FrameCorners { frame, corners: scene.see(&pose, [0.0; 4], &mut random) });
    }
    for (index, azimuth) in [0.0, 1.5, 3.0, 4.5].into_iter().enumerate() {
        let corners = scene.see(&pose(0.6, azimuth, 0.0, [0.0, 0.0, 0.3]), [0.0; 4], &mut random);
        frames.push(FrameCorners { frame: 6 + index, corners });
    }
    frames[7].corners.truncate(8);
    let found = run(&frames, None, Method::Paper).unwrap();
    let used: Vec<usize> = found.views.iter().map(|v| v.frame).collect();
    // 3.5 cm from 5 to 8.5 is too near; 9 is 4 cm from 5.
    assert_eq!(used, [0, 2, 4, 6, 8, 9]);
    assert!(matches!(
        found.rejected[0].reason,
        Rejection::NearAccepted { accepted: 0, distance_m } if (distance_m - 0.03).abs() < 2e-3
    ));
    assert!(found.rejected.iter().any(|r| {
        r.frame == 7 && r.reason == Rejection::FewCorners { n_corners: 8, needed: 9 }
    }));
    assert_eq!(found.parameters.len(), 1);
    let pinhole = found.camera.intrinsics;
    assert_eq!((pinhole.cx, pinhole.cy, pinhole.fx), (FACTORY.cx, FACTORY.cy, pinhole.fy));
    assert!(found.outliers.is_empty() && found.distortion.is_none());
}
