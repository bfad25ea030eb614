//! The whole room on corners of known cameras.

use super::{
    Calibration, Error, Estimate, FrameCorners, Input, Lens, Method, Model, RejectedFrame,
    Rejection, SurfaceKind, calibrate, calibrate_from, coverage, guess_intrinsics,
    synthetic::{FACTORY, Random, Scene, board, pose, tables},
};
use crate::{
    board::CharucoBoard,
    camera::{Brown, Distortion, Intrinsics, TablePair},
    detect::Corner,
    geom::{Board, Color, Pixel, Point, Pose, Rotation, Vector3},
    math,
    solve::{mean, rms},
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
            assert!((a.value - b.value).abs() < 4.0 * math::hypot(a.sigma, b.sigma));
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
        531.0 * (math::hypot(corner[0], corner[1]) - math::hypot(straight[0], straight[1]))
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

/// The board's height at each corner less the best plane, for a wave of [`Scene::see`].
fn true_heights_m(wave: [f64; 4], wave_m: f64) -> Vec<f64> {
    let board = board();
    let places: Vec<[f64; 2]> = (0..board.n_corners())
        .map(|id| [board.corner(id).x() / 0.104 - 1.0, board.corner(id).y() / 0.0835 - 1.0])
        .collect();
    let form = |[s, t]: [f64; 2]| {
        wave_m * (wave[0] * s * s + wave[1] * t * t + wave[2] * s * t + wave[3] * s * s * s)
    };
    let heights: Vec<f64> = places.iter().map(|p| form(*p)).collect();
    // The corners are a grid about nearly (0, 0): the plane's three parts are all but independent.
    let n = places.len() as f64;
    let about = |axis: usize| places.iter().map(|p| p[axis]).sum::<f64>() / n;
    let middle = [about(0), about(1)];
    let slope = |axis: usize| {
        let along = |p: &[f64; 2]| p[axis] - middle[axis];
        let sum: f64 = places.iter().zip(&heights).map(|(p, h)| along(p) * h).sum();
        sum / places.iter().map(|p| along(p).powi(2)).sum::<f64>()
    };
    let (mean, slopes) = (mean(&heights), [slope(0), slope(1)]);
    let plane =
        |p: &[f64; 2]| mean + slopes[0] * (p[0] - middle[0]) + slopes[1] * (p[1] - middle[1]);
    places.iter().zip(&heights).map(|(p, h)| h - plane(p)).collect()
}

/// Twenty views of a board of this form.
fn views_of(wave: [f64; 4], wave_m: f64, seed: u64) -> Vec<FrameCorners> {
    let scene = Scene { wave_m, noise_px: 0.05, ..Scene::new(Distortion::None) };
    let mut random = Random(seed);
    (0..20)
        .map(|frame| {
            let azimuth = random.uniform(0.0, std::f64::consts::TAU);
            let at = [(-0.03, 0.03), (-0.03, 0.03), (0.2, 0.35)]
                .map(|(low, high)| random.uniform(low, high));
            let pose = pose(random.uniform(0.2, 0.7), azimuth, random.uniform(-1.0, 1.0), at);
            FrameCorners { frame, corners: scene.see(&pose, wave, &mut random) }
        })
        .collect()
}

/// The simplest shape that explains the board is chosen, and is the true one within its σ.
#[test]
fn finds_the_shape_of_the_board() {
    let cases = [
        ([0.0; 4], SurfaceKind::Flat),
        ([1.0, -0.5, 0.0, 0.0], SurfaceKind::Bend),
        ([0.6, 0.3, -0.7, 0.8], SurfaceKind::Free),
    ];
    for (wave, kind) in cases {
        let frames = views_of(wave, 5e-4, 7);
        let found = run(&frames, None, Method::Robust(Model::FocalCentre)).unwrap();
        assert_eq!(found.surfaces.len(), 3);
        assert_eq!(found.surface.as_ref().map_or(SurfaceKind::Flat, |s| s.kind), kind);
        assert!(found.rms_px < 0.075, "√2·0.05 is all that is left: {}", found.rms_px);
        let truth = true_heights_m(wave, 5e-4);
        let Some(surface) = found.surface else { continue };
        let off: Vec<f64> = (0..truth.len())
            .map(|id| (surface.heights_m[id] - truth[id]) / surface.sigmas_m[id])
            .collect();
        assert!(rms(&off) > 0.3 && rms(&off) < 1.6, "{kind:?}: {}", rms(&off));
        assert!(surface.sigmas_m.iter().all(|s| *s < 3e-5), "{kind:?}");
        let range = |h: &[f64]| {
            let fold = |f: fn(f64, f64) -> f64| h.iter().copied().reduce(f).unwrap();
            fold(f64::max) - fold(f64::min)
        };
        let size = surface.size_m();
        assert!((size.value - range(&truth)).abs() < 4.0 * size.sigma, "{size:?}");
    }
}

/// Boards of 266 and of 1131 corners: their surfaces are free, too, on fewer knots than corners.
#[test]
fn finds_the_shape_of_large_boards() {
    for text in ["20x15:14mm:7mm:4X4_250", "40x30:7mm:3.5mm:6X6_1000"] {
        let board: CharucoBoard = text.parse().unwrap();
        let camera = Scene::new(Distortion::None).camera;
        let size = [board.squares_x, board.squares_y].map(|n| n as f64 * board.square_m);
        let height_m = |p: &Point<Board>| {
            let [s, t] = [2.0 * p.x() / size[0] - 1.0, 2.0 * p.y() / size[1] - 1.0];
            5e-4 * (0.6 * s * s + 0.3 * t * t - 0.7 * s * t + 0.8 * s * s * s)
        };
        let mut random = Random(11);
        let frames: Vec<FrameCorners> = (0..16)
            .map(|frame| {
                let azimuth = random.uniform(0.0, std::f64::consts::TAU);
                let tilt = Vector3::new(math::cos(azimuth), math::sin(azimuth), 0.0)
                    * random.uniform(0.2, 0.7);
                let turn = Rotation::from_scaled_axis(tilt);
                let middle = Vector3::new(0.5 * size[0], 0.5 * size[1], 0.0);
                let at = [(-0.03, 0.03), (-0.03, 0.03), (0.3, 0.5)]
                    .map(|(low, high)| random.uniform(low, high));
                let pose = Pose::<Color, Board>::new(turn, Vector3::from(at) - turn * middle);
                let mut see = |id| {
                    let flat = board.corner(id);
                    let point = Point::new(flat.x(), flat.y(), height_m(&flat));
                    let pixel = camera.project(pose * point)?;
                    let pixel = Pixel::new(
                        pixel.x + 0.05 * random.normal(),
                        pixel.y + 0.05 * random.normal(),
                    );
                    let inside = (2.0..637.0).contains(&pixel.x) && (2.0..477.0).contains(&pixel.y);
                    inside.then_some(Corner { id, pixel, sigma_px: 0.05 })
                };
                let corners = (0..board.n_corners()).filter_map(&mut see).collect();
                FrameCorners { frame, corners }
            })
            .collect();
        let input = Input { board: &board, factory: &FACTORY, tables: None, frames: &frames };
        let found = calibrate(&input, Method::Robust(Model::FocalCentre)).unwrap();
        let surface = found.surface.as_ref().unwrap();
        assert_eq!(surface.kind, SurfaceKind::Free, "{text}");
        assert!(found.rms_px < 0.075, "√2·0.05 is all that is left: {}", found.rms_px);
        assert!(normalised(found.focal_px(), 531.0).abs() < 4.0, "{:?}", found.focal_px());
        // Poses, heights and print belong together, but for products of the plane's slope with heights: 0.011 px on the
        // largest board, less than the corners' noise.
        for view in &found.views {
            for (corner, residual) in view.corners.iter().zip(&view.residuals_px) {
                let point = view.color_from_board * surface.corner(&board, corner.id);
                let seen = corner.pixel - found.camera.project(point).unwrap();
                let off = math::hypot(seen[0] - residual[0], seen[1] - residual[1]);
                assert!(off < 0.02, "{text}: {off} px");
            }
        }
        // Less the plane of the poses: the difference of two surfaces without a plane of its own.
        let off: Vec<f64> = (0..board.n_corners())
            .map(|id| surface.heights_m[id] - height_m(&board.corner(id)))
            .collect();
        let places = (0..board.n_corners()).map(|id| board.corner(id).coords).collect::<Vec<_>>();
        let plane = super::surface::best_plane(&places, &off);
        let off: Vec<f64> = places
            .iter()
            .zip(&off)
            .zip(&surface.sigmas_m)
            .map(|((p, off), sigma)| (off - (plane.x + plane.y * p.x + plane.z * p.y)) / sigma)
            .collect();
        assert!(rms(&off) > 0.3 && rms(&off) < 1.6, "{text}: {}", rms(&off));
        assert!(surface.sigmas_m.iter().all(|s| *s < 5e-5), "{text}");
    }
}

/// Nothing known of the camera: a guess to start from, and fx ≠ fy found.
#[test]
fn a_camera_of_which_nothing_is_known() {
    let mut scene = Scene { n_views: 20, ..Scene::new(Distortion::None) };
    let lens = Brown { k1: 0.05, k2: -0.04, ..Brown::ZERO };
    scene.camera.distortion = Distortion::Brown(lens);
    scene.camera.intrinsics = Intrinsics { fx: 620.0, fy: 626.0, cx: 310.0, ..FACTORY };
    let frames = scene.frames(3);
    let guess = guess_intrinsics(&board(), &frames, [640, 480]);
    assert!((guess.fx / 620.0 - 1.0).abs() < 0.1, "{guess:?}");
    let input = Input { board: &board(), factory: &guess, tables: None, frames: &frames };
    let found = calibrate(&input, Method::Unaided).unwrap();
    assert_eq!(found.model, Model::BrownAspect);
    assert!(normalised(found.focal_px(), 620.0).abs() < 4.0);
    assert!(normalised(found.parameter("aspect").unwrap(), 626.0 / 620.0).abs() < 4.0);
    assert!(normalised(found.parameter("center_x_px").unwrap(), 310.0).abs() < 4.0);
    // Nothing to go by is no error: the larger side of the image.
    assert_eq!(guess_intrinsics(&board(), &[], [1280, 720]).fx, 1280.0);
}

/// Which views are missing, and where in the image.
#[test]
fn says_what_is_missing() {
    let scene = Scene { n_views: 8, tilt_rad: [0.0, 0.01], ..Scene::new(Distortion::None) };
    let frames = scene.frames(3);
    let input = Input { board: &board(), factory: &FACTORY, tables: None, frames: &frames };
    let straight = coverage(&input);
    assert_eq!(straight.missing_tilts().len(), 4);
    assert!(straight.advice().unwrap().contains("tilted by 20° to 45° to all sides"));
    // Always the same side nearest, and never the left of the image.
    let mut random = Random(9);
    let frames: Vec<FrameCorners> = (0..8)
        .map(|frame| {
            // About an axis upwards in the image: the right side comes nearer.
            let tilt = random.uniform(0.4, 0.6);
            let pose = pose(tilt, std::f64::consts::FRAC_PI_2, 0.0, [0.13, 0.0, 0.4 + 0.02 * tilt]);
            FrameCorners { frame, corners: scene.see(&pose, [0.0; 4], &mut random) }
        })
        .collect();
    let one_side = coverage(&Input { frames: &frames, ..input });
    assert_eq!(one_side.missing_tilts(), ["bottom", "left", "top"], "{one_side:?}");
    assert!(one_side.missing_places().contains(&"left"), "{one_side:?}");
    assert_eq!(
        one_side.n_corners.iter().sum::<usize>(),
        frames.iter().map(|f| f.corners.len()).sum::<usize>()
    );
}

/// The camera turns (radians about x, y, z, to first order) while the rows of each frame are read.
fn turning(frames: &mut [FrameCorners], mut turn: impl FnMut() -> [f64; 3]) {
    for frame in frames {
        let turn = turn();
        for corner in &mut frame.corners {
            let (f, time) = (531.0, corner.pixel.y / 480.0 - 0.5);
            let [x, y] = [(corner.pixel.x - 321.5) / f, (corner.pixel.y - 240.4) / f];
            let [a, b, c] = turn.map(|t| t * time);
            corner.pixel.x += f * (-a * x * y + b * (1.0 + x * x) - c * y);
            corner.pixel.y += f * (-a * (1.0 + y * y) + b * x * y + c * x);
        }
    }
}

/// Views that turn by 6 mrad while they are read are told from still ones, and σ clustered by picture knows of it.
#[test]
fn tells_a_rolling_shutter() {
    let scene = Scene { n_views: 20, ..Scene::new(Distortion::None) };
    let still = run(&scene.frames(4), None, Method::Robust(Model::FocalCentre)).unwrap();
    let still = still.rolling_shutter.unwrap();
    assert!((0.9..1.1).contains(&still.residual_share), "{still:?}");
    assert!(still.turn_sigma_rad < 6e-4, "{still:?}");
    let mut random = Random(5);
    let mut squares = 0.0;
    for seed in 0..6 {
        let mut frames = scene.frames(seed);
        turning(&mut frames, || [(); 3].map(|()| 6e-3 * random.normal()));
        let found = run(&frames, None, Method::Robust(Model::FocalCentre)).unwrap();
        let shutter = found.rolling_shutter.unwrap();
        assert!(shutter.residual_share < 0.8 && shutter.turn_sigma_rad > 3e-3, "{shutter:?}");
        // One centre, one σ, whichever fit it is of.
        let hypothesis = found.distortion.as_ref().expect("is tested").hypotheses[0].clone();
        assert_eq!(hypothesis.lens, Lens::None);
        for (name, k) in [("center_x_px", 0), ("center_y_px", 1)] {
            let shift = shutter.center_shift_px.expect("is free")[k].abs();
            let sigmas =
                [found.parameter(name).expect("is free").sigma, hypothesis.center_px[k].sigma];
            assert!(sigmas.iter().all(|sigma| *sigma >= shift), "{sigmas:?} {shift}");
            assert!((sigmas[0] / sigmas[1] - 1.0).abs() < 0.1, "{sigmas:?}");
        }
        squares += normalised(found.focal_px(), 531.0).powi(2) / 6.0;
    }
    assert!(squares < 3.0, "{squares}");
}

/// The σ of a board's shape where views turn while they are read, most of it the same way each time.
#[test]
fn knows_the_shape_of_a_board_seen_in_motion() {
    let wave = [0.6, 0.3, -0.7, 0.8];
    let truth = true_heights_m(wave, 5e-4);
    let mut random = Random(8);
    const N: u64 = 8;
    let (mut squares, mut sigma_m) = (0.0, 0.0);
    for seed in 0..N {
        let mut frames = views_of(wave, 5e-4, seed);
        turning(&mut frames, || [0.0, 0.0, 4e-3].map(|same| same + 1e-3 * random.normal()));
        let found = run(&frames, None, Method::Robust(Model::FocalCentre)).unwrap();
        let surface = found.surface.unwrap();
        assert_eq!(surface.kind, SurfaceKind::Free);
        for (id, height_m) in truth.iter().enumerate() {
            let off = (surface.heights_m[id] - height_m) / surface.sigmas_m[id];
            squares += off * off / (N as f64 * truth.len() as f64);
        }
        sigma_m += mean(&surface.sigmas_m) / N as f64;
    }
    assert!((0.5..1.6).contains(&squares), "{squares}");
    assert!(sigma_m < 3e-5, "{sigma_m}");
}

/// The more the views leave open, the more a wrong calibration may cost; and it says where.
#[test]
fn projection_is_least_known_where_nothing_was_seen() {
    let scene = Scene::new(Distortion::None);
    let run = |model| run(&scene.frames(6), None, Method::Robust(model)).unwrap();
    let grid = |found: &Calibration| found.projection_uncertainty(5, 5, 0.3).unwrap();
    // No corner of a view reaches the corners of the image: five coefficients of a lens say nothing there.
    let (whole, simple) = (run(Model::Brown), run(Model::FocalCentre));
    let (whole_grid, simple_grid) = (grid(&whole), grid(&simple));
    assert_eq!(whole_grid.sigma_px.len(), 25);
    assert!(whole_grid.sigma_px[24] > 20.0 * whole_grid.sigma_px[12], "{:?}", whole_grid.sigma_px);
    assert!(whole.unknown_px().is_some_and(|px| px > 1.0));
    assert!(simple_grid.sigma_px.iter().all(|s| *s < 0.5), "{:?}", simple_grid.sigma_px);
    assert!(simple.unknown_px().is_none());
    let m = 0.3 / whole.camera.intrinsics.focal_px();
    assert!((whole_grid.sigma_m[3] / whole_grid.sigma_px[3] - m).abs() < 1e-15);
    assert!(whole.projection_uncertainty(1, 5, 0.3).is_none());
    assert!(whole.projection_uncertainty(5, 5, 0.0).is_none());
    // Without each picture the focal length moves by less than a few of its σ.
    let focal = whole.focal_px();
    assert_eq!(whole.left_out.len(), whole.n_pictures);
    assert!(whole.left_out.iter().all(|l| (l.focal_px - focal.value).abs() < 3.0 * focal.sigma));
}

/// A recording of minutes: the hand rests at 60 places, five frames at each, all with the same noise.
fn long_recording(seed: u64) -> Vec<FrameCorners> {
    let scene = Scene { n_views: 60, noise_px: 0.0, ..Scene::new(Distortion::None) };
    let mut random = Random(seed + 77);
    let mut frames: Vec<FrameCorners> =
        scene.frames(seed).iter().flat_map(|frame| std::iter::repeat_n(frame.clone(), 5)).collect();
    for (index, frame) in frames.iter_mut().enumerate() {
        frame.frame = index;
        for corner in &mut frame.corners {
            corner.pixel.x += 0.1 * random.normal();
            corner.pixel.y += 0.1 * random.normal();
            corner.sigma_px = 0.1;
        }
    }
    frames
}

/// The most telling views are nearly as good as all, better than as many spread evenly, and their σ are honest.
#[test]
fn few_of_many_views() {
    let truth = Scene::new(Distortion::None).camera.intrinsics.fx;
    let method = Method::Robust(Model::FocalCentre);
    let (mut squares, mut ratios, mut against_even) = (0.0, Vec::new(), Vec::new());
    const N: u64 = 12;
    for seed in 0..N {
        let frames = long_recording(seed);
        let of = |frames: &[FrameCorners], n: usize| {
            let board = board();
            let input = Input { board: &board, factory: &FACTORY, tables: None, frames };
            calibrate_from(&input, method, n).unwrap()
        };
        let (all, few) = (of(&frames, 1000), of(&frames, 40));
        assert!(all.chosen.is_none() && all.views.len() == 300);
        let chosen = few.chosen.unwrap();
        assert_eq!([few.views.len(), chosen.n_chosen, chosen.n_usable], [40, 40, 300]);
        // Nearly every picture is among them: 40 of 300 views at random would show two thirds of some thirty.
        let (shown, all_pictures) = (few.n_pictures as f64, chosen.n_pictures as f64);
        assert!(shown > 0.8 * all_pictures, "{shown} of {all_pictures}");
        let left_out = |r: &&RejectedFrame| r.reason == Rejection::NotChosen { n_chosen: 40 };
        assert_eq!(few.rejected.iter().filter(left_out).count(), 260);
        let even: Vec<FrameCorners> = (0..40).map(|i| frames[i * 300 / 40].clone()).collect();
        ratios.push(few.focal_px().sigma / all.focal_px().sigma);
        against_even.push(few.focal_px().sigma / of(&even, 1000).focal_px().sigma);
        squares += normalised(few.focal_px(), truth).powi(2) / N as f64;
    }
    // 40 of 60 pictures, one of five views each: the root of 7.5 is 2.7 where all views tell the same.
    assert!(mean(&ratios) < 2.3, "{ratios:?}");
    assert!(mean(&against_even) < 1.0, "{against_even:?}");
    assert!(squares < 2.0, "{squares}");
}

/// The choice does not depend on the order in which frames are given.
#[test]
fn order_of_many_frames_does_not_matter() {
    let mut frames = long_recording(3);
    let board = board();
    let run = |frames: &[FrameCorners]| {
        let input = Input { board: &board, factory: &FACTORY, tables: None, frames };
        format!("{:?}", calibrate_from(&input, Method::Auto, 30).unwrap())
    };
    let first = run(&frames);
    frames.reverse();
    frames.swap(5, 200);
    assert_eq!(first, run(&frames));
}

/// One thread and three give the same bits.
#[test]
fn threads_do_not_matter() {
    let tables = tables();
    let frames = Scene { wave_m: 3e-4, ..Scene::new(Distortion::None) }.frames(9);
    let on = |n| {
        let result =
            crate::par::on_threads(n, || run(&frames, Some(&tables), Method::Auto).unwrap());
        format!("{result:?}")
    };
    assert_eq!(on(1), on(3));
}
