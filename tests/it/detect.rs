//! The detector on scenes with ground truth and on the real recordings.

use std::{collections::BTreeMap, fs};

use truedepth::{
    board::{CharucoBoard, Layout},
    camera::{Brown, Camera, Distortion, Intrinsics},
    detect::{Detector, Observation, Reason},
    geom::{Board, Color, Pixel, Pose, Rotation, Vector3},
    image::{Gray, Limits},
    simulate::{Handedness, Motion, Noise, Polarity, Rendered, Scene, render},
};

const PAPER: &str = "10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL";

fn board(text: &str) -> CharucoBoard {
    text.parse().expect("a board")
}

fn camera(focal_px: f64, width: usize, height: usize) -> Camera {
    let (cx, cy) = (width as f64 / 2.0 - 0.3, height as f64 / 2.0 + 0.4);
    let intrinsics = Intrinsics { fx: focal_px, fy: focal_px, cx, cy, width, height };
    Camera { intrinsics, distortion: Distortion::None }
}

/// The board's middle at (0, 0, `distance_m`), turned by these angles about x, y and z (degrees).
fn pose(board: &CharucoBoard, distance_m: f64, turn_deg: [f64; 3]) -> Pose<Color, Board> {
    let [x, y, z] = turn_deg.map(f64::to_radians);
    let rotation =
        Rotation::from_euler_angles(x, y, 0.0) * Rotation::from_euler_angles(0.0, 0.0, z);
    let middle = Vector3::new(
        board.squares_x as f64 * board.square_m / 2.0,
        board.squares_y as f64 * board.square_m / 2.0,
        0.0,
    );
    Pose::new(rotation, Vector3::new(0.0, 0.0, distance_m) - rotation * middle)
}

/// Views from all sides, no two alike.
fn views(board: &CharucoBoard) -> Vec<Pose<Color, Board>> {
    [
        (0.36, [0.0, 0.0, 0.0]),
        (0.36, [20.0, -15.0, 31.0]),
        (0.40, [-35.0, 10.0, 100.0]),
        (0.45, [10.0, 45.0, -75.0]),
        (0.28, [-12.0, -20.0, 170.0]),
        (0.24, [25.0, 25.0, 7.0]),
    ]
    .map(|(distance_m, turn)| pose(board, distance_m, turn))
    .to_vec()
}

/// Differences to the truth, per corner, with the σ claimed. Panics on a corner that is not there.
fn errors(rendered: &Rendered, seen: &Observation) -> Vec<([f64; 2], f64)> {
    let truth: BTreeMap<usize, Pixel> = rendered.corners.iter().map(|c| (c.id, c.pixel)).collect();
    seen.corners
        .iter()
        .map(|c| {
            let at =
                truth.get(&c.id).unwrap_or_else(|| panic!("corner {} is not in the image", c.id));
            let [dx, dy] = c.pixel - *at;
            assert!(dx.hypot(dy) < 1.0, "corner {} is {dx:.2}, {dy:.2} px off", c.id);
            ([dx, dy], c.sigma_px)
        })
        .collect()
}

#[test]
fn corners_are_accurate_unbiased_and_know_their_sigma() {
    let board = board(PAPER);
    let detector = Detector::new(&board);
    for (blur_sigma_px, noise) in
        [(0.5, 1.0), (0.6, 1.0), (0.9, 3.0), (1.2, 3.0), (1.6, 3.0), (2.0, 3.0), (2.0, 1.0)]
    {
        let mut all = Vec::new();
        let mut n_true = 0;
        for (index, color_from_board) in views(&board).into_iter().enumerate() {
            let mut scene = Scene::ideal(board.clone(), camera(590.0, 640, 480), color_from_board);
            scene.blur_sigma_px = blur_sigma_px;
            scene.noise = Noise::Gray { sigma: noise };
            let rendered = render(&scene, index as u64);
            n_true += rendered.corners.len();
            all.extend(errors(&rendered, &detector.detect(&rendered.gray())));
        }
        let n = all.len() as f64;
        assert!(n >= 0.98 * n_true as f64, "{n} of {n_true} corners");
        let rms = (all.iter().map(|([x, y], _)| x * x + y * y).sum::<f64>() / n).sqrt();
        let bias = [0, 1].map(|a| all.iter().map(|(d, _)| d[a]).sum::<f64>() / n);
        let variance =
            all.iter().map(|([x, y], s)| (x * x + y * y) / (2.0 * s * s)).sum::<f64>() / n;
        println!(
            "blur {blur_sigma_px} noise {noise}: {n} corners, rms {rms:.4} px, bias {:+.4} {:+.4} px, \
             normalised variance {variance:.2}",
            bias[0], bias[1]
        );
        // Asked for blur up to 1.2 px.
        assert!(
            rms < if blur_sigma_px > 1.2 { 0.08 } else { 0.05 },
            "blur {blur_sigma_px}, noise {noise}: rms {rms} px"
        );
        assert!(bias[0].abs().max(bias[1].abs()) < 0.01, "bias {bias:?} px");
        assert!((0.8..1.2).contains(&variance), "blur {blur_sigma_px}, noise {noise}: {variance}");
    }
}

/// Where the rim round a marker is narrow, blur brings its edge and bits to the corner: σ says so.
#[test]
fn sigma_is_honest_beside_wide_markers() {
    for marker in [0.6, 0.7, 0.75, 0.8] {
        let board = board(&format!("10x8:20mm:{}mm:4X4_50", 20.0 * marker));
        let detector = Detector::new(&board);
        for (blur_sigma_px, noise) in [(0.6, 1.0), (1.2, 1.0), (1.2, 3.0), (2.0, 3.0)] {
            let mut squares = Vec::new();
            for (index, color_from_board) in views(&board).into_iter().enumerate() {
                let mut scene =
                    Scene::ideal(board.clone(), camera(590.0, 640, 480), color_from_board);
                scene.blur_sigma_px = blur_sigma_px;
                scene.noise = Noise::Gray { sigma: noise };
                let rendered = render(&scene, index as u64);
                let seen = errors(&rendered, &detector.detect(&rendered.gray()));
                squares.extend(seen.iter().map(|([x, y], s)| (x * x + y * y) / (2.0 * s * s)));
            }
            let n = squares.len();
            let variance = squares.iter().sum::<f64>() / n as f64;
            println!(
                "markers {marker}, blur {blur_sigma_px}, noise {noise}: {n} corners, {variance:.2}"
            );
            assert!(
                (0.8..1.2).contains(&variance),
                "{marker}, {blur_sigma_px}, {noise}: {variance}"
            );
        }
    }
}

#[test]
fn layouts_are_told_apart() {
    for layout in [Layout::Legacy, Layout::New] {
        let board = board(PAPER);
        let mut scene = Scene::ideal(board.clone(), camera(590.0, 640, 480), views(&board)[1]);
        scene.print.layout = layout;
        scene.blur_sigma_px = 0.8;
        let rendered = render(&scene, 1);
        let seen = Detector::new(&board).detect(&rendered.gray());
        assert_eq!(seen.identity.as_ref().map(|i| i.layout), Some(layout));
        assert_eq!(errors(&rendered, &seen).len(), 63);
    }
}

#[test]
fn mirrored_and_inverted_prints_are_recognised() {
    let board = board(PAPER);
    for (handedness, polarity) in [
        (Handedness::Mirrored, Polarity::BlackOnWhite),
        (Handedness::AsDesigned, Polarity::WhiteOnBlack),
        (Handedness::Mirrored, Polarity::WhiteOnBlack),
    ] {
        let mut scene = Scene::ideal(board.clone(), camera(590.0, 640, 480), views(&board)[1]);
        (scene.print.handedness, scene.print.polarity) = (handedness, polarity);
        scene.blur_sigma_px = 0.8;
        let rendered = render(&scene, 1);
        let seen = Detector::new(&board).detect(&rendered.gray());
        let identity = seen.identity.as_ref().expect("identified");
        assert_eq!(identity.mirrored, handedness == Handedness::Mirrored);
        assert_eq!(identity.inverted, polarity == Polarity::WhiteOnBlack);
        assert_eq!(errors(&rendered, &seen).len(), 63);
    }
}

#[test]
fn other_boards_and_sizes() {
    for (text, width, height, focal_px, distance_m) in [
        ("7x5:30mm:21mm:4X4_50", 1280, 720, 900.0, 0.45),
        ("5x7:40mm:20mm:6X6_250", 640, 480, 500.0, 0.5),
        ("12x9:15mm:11mm:5X5_1000", 1440, 1080, 1200.0, 0.35),
        ("9x6:25mm:18mm:APRILTAG_36h11", 800, 600, 700.0, 0.4),
        ("8x6:30mm:22mm:7X7_250", 4032, 3024, 3000.0, 0.4),
        ("6x4:30mm:22mm:4X4_50", 160, 120, 130.0, 0.3),
        ("3x3:30mm:22mm:4X4_50", 640, 480, 600.0, 0.3), // four corners
    ] {
        let board = board(text);
        let mut scene = Scene::ideal(
            board.clone(),
            camera(focal_px, width, height),
            pose(&board, distance_m, [18.0, -12.0, 25.0]),
        );
        scene.blur_sigma_px = 0.7 * (width as f64 / 640.0).max(1.0);
        scene.noise = Noise::Gray { sigma: 2.0 };
        let rendered = render(&scene, 3);
        let seen = Detector::new(&board).detect(&rendered.gray());
        let found = errors(&rendered, &seen).len();
        let whole = rendered
            .corners
            .iter()
            .filter(|c| {
                let inside = |v: f64, size: usize| v > 8.0 && v < size as f64 - 9.0;
                inside(c.pixel.x, width) && inside(c.pixel.y, height)
            })
            .count();
        assert!(found >= whole, "{text}: {found} of {whole} corners: {:?}", seen.rejects);
    }
}

/// Inside a board of even rows and odd columns both layouts show the same, one column apart: only who knows the layout
/// can number it, and nobody else does.
#[test]
fn a_view_that_fits_both_layouts_asks_for_the_word_of_the_printer() {
    let unknown = board("11x8:30mm:21mm:6X6_250");
    let known = board("11x8:30mm:21mm:6X6_250:legacy");
    let mut scene = Scene::ideal(
        unknown.clone(),
        camera(900.0, 640, 480),
        pose(&unknown, 0.30, [12.0, -8.0, 0.0]),
    );
    scene.print.layout = Layout::Legacy;
    scene.blur_sigma_px = 0.8;
    let rendered = render(&scene, 5);
    let inside = Detector::new(&unknown).detect(&rendered.gray());
    assert!(inside.corners.is_empty(), "{:?}", inside.identity);
    assert!(inside.rejects.iter().any(|r| r.reason == Reason::Ambiguous));
    let seen = Detector::new(&known).detect(&rendered.gray());
    assert!(errors(&rendered, &seen).len() >= 12, "{:?}", seen.rejects);
}

#[test]
fn motion_does_not_hide_the_board() {
    let board = board(PAPER);
    let detector = Detector::new(&board);
    for (index, color_from_board) in views(&board).into_iter().enumerate() {
        for (motion_px, handedness) in [
            (4.0, Handedness::AsDesigned),
            (7.0, Handedness::AsDesigned),
            (7.0, Handedness::Mirrored),
        ] {
            let mut scene = Scene::ideal(board.clone(), camera(590.0, 640, 480), color_from_board);
            let distance_m = 0.35;
            let angle = 0.7 * index as f64;
            scene.motion = Motion {
                translation_m: Vector3::new(angle.cos(), angle.sin(), 0.0)
                    * (motion_px * distance_m / 590.0),
                ..Motion::NONE
            };
            scene.blur_sigma_px = 0.8;
            scene.noise = Noise::Gray { sigma: 2.0 };
            scene.print.handedness = handedness;
            let rendered = render(&scene, index as u64);
            let seen = detector.detect(&rendered.gray());
            let found = errors(&rendered, &seen).len();
            let n_true = rendered.corners.len();
            assert!(
                found as f64 >= 0.9 * n_true as f64,
                "view {index}, {motion_px} px, {handedness:?}: {found} of {n_true}"
            );
            let mirrored = seen.identity.expect("corners have an identity").mirrored;
            assert_eq!(mirrored, handedness == Handedness::Mirrored, "view {index}");
        }
    }
}

/// The image's left and right border are seen at 45° and more, through a lens that moves what is there inwards by a
/// quarter of its distance from the middle, or outwards by a fourteenth.
#[test]
fn wide_angle_lenses_are_tolerated() {
    let board = board(PAPER);
    let detector = Detector::new(&board);
    for (k1, k2) in [(-0.16, 0.015), (0.08, 0.0)] {
        let camera = Camera {
            distortion: Distortion::Brown(Brown { k1, k2, p1: 0.0, p2: 0.0, k3: 0.0 }),
            ..camera(320.0, 640, 480)
        };
        // In the middle, where the board fills the image, and at two of its borders.
        for (index, (distance_m, turn, [x, y])) in [
            (0.16, [8.0, -6.0, 12.0], [0.0, 0.0]),
            (0.17, [-14.0, 18.0, 95.0], [0.08, 0.02]),
            (0.18, [20.0, -15.0, 190.0], [-0.07, -0.05]),
        ]
        .into_iter()
        .enumerate()
        {
            let mut color_from_board = pose(&board, distance_m, turn);
            color_from_board.translation += Vector3::new(x, y, 0.0);
            let mut scene = Scene::ideal(board.clone(), camera.clone(), color_from_board);
            scene.blur_sigma_px = 0.7;
            scene.noise = Noise::Gray { sigma: 2.0 };
            let rendered = render(&scene, index as u64);
            let seen = detector.detect(&rendered.gray());
            let found = errors(&rendered, &seen);
            let n_true = rendered
                .corners
                .iter()
                .filter(|c| (8.0..631.0).contains(&c.pixel.x) && (8.0..471.0).contains(&c.pixel.y))
                .count();
            let rms = found.iter().map(|([x, y], _)| x * x + y * y).sum::<f64>();
            let rms = (rms / found.len() as f64).sqrt();
            println!("k1 {k1}, view {index}: {} of {n_true} corners, rms {rms:.3} px", found.len());
            assert!(found.len() as f64 >= 0.98 * n_true as f64, "{} of {n_true}", found.len());
            assert!(rms < 0.06, "{rms} px");
        }
    }
}

/// Smears of up to four bits of a marker: most boards are still told, and none wrongly. Once a false row of nodes at
/// the board's rim kept the true placement from being tried, and a shifted one won.
#[test]
fn heavy_motion_never_misnumbers() {
    let board = board(PAPER);
    let detector = Detector::new(&board);
    let (mut n_identified, mut n_views) = (0, 0);
    for (distance_m, motion_px) in [(0.15, 18.0), (0.15, 32.0), (0.2, 25.0)] {
        for k in 0..12_u32 {
            let angle = 0.52 * f64::from(k);
            let (tilt_x, tilt_y) = (20.0 * (3.0 * angle).sin(), 20.0 * (2.0 * angle).cos());
            let mut color_from_board =
                pose(&board, distance_m, [tilt_x, tilt_y, 37.0 * f64::from(k)]);
            let aside = Vector3::new(0.03 * angle.sin(), 0.03 * angle.cos(), 0.0);
            color_from_board =
                Pose::new(color_from_board.rotation, color_from_board.translation + aside);
            let mut scene = Scene::ideal(board.clone(), camera(590.0, 640, 480), color_from_board);
            scene.motion = Motion {
                translation_m: Vector3::new(angle.cos(), angle.sin(), 0.0)
                    * (motion_px * distance_m / 590.0),
                ..Motion::NONE
            };
            scene.blur_sigma_px = 0.8;
            scene.noise = Noise::Gray { sigma: 2.0 };
            let rendered = render(&scene, k.into());
            let seen = detector.detect(&rendered.gray());
            n_views += 1;
            n_identified += i32::from(seen.identity.is_some());
            for corner in &seen.corners {
                let at = rendered.corners.iter().find(|c| c.id == corner.id);
                let off = at.map_or(f64::INFINITY, |c| c.pixel.distance(corner.pixel));
                // Where in so long a smear the corner is, is another question; squares are 60 pixels and more.
                assert!(
                    off < 8.0,
                    "{distance_m} m, {motion_px} px, view {k}: corner {} is {off:.1} px off",
                    corner.id
                );
            }
        }
    }
    println!("{n_identified} of {n_views} boards identified");
    assert!(n_identified >= n_views * 9 / 10, "{n_identified} of {n_views}");
}

/// Two equal boards in one picture: the corners are those of one of them.
#[test]
fn two_equal_boards_are_never_mixed() {
    let board = board("6x5:20mm:14mm:4X4_50");
    let detector = Detector::new(&board);
    let scene = |distance_m: f64, turn_deg: [f64; 3]| {
        let color_from_board = pose(&board, distance_m, turn_deg);
        let mut scene = Scene::ideal(board.clone(), camera(500.0, 320, 480), color_from_board);
        scene.blur_sigma_px = 0.8;
        scene.noise = Noise::Gray { sigma: 1.0 };
        scene
    };
    for (k, (near, far)) in [(0.26, 0.26), (0.26, 0.34), (0.34, 0.26)].into_iter().enumerate() {
        let left = render(&scene(near, [12.0, -8.0, 20.0]), k as u64);
        let right = render(&scene(far, [-10.0, 15.0, 100.0]), 7 + k as u64);
        let (a, b) = (left.gray(), right.gray());
        let pixels = (0..480).flat_map(|y| [a.row(y), b.row(y)].concat()).collect();
        let seen = detector.detect(&Gray::new(640, 480, pixels));
        assert!(seen.corners.len() >= 18, "{} corners", seen.corners.len());
        let fits = |truth: &Rendered, shift: f64| {
            seen.corners.iter().all(|corner| {
                truth.corners.iter().any(|c| {
                    let at = Pixel::new(c.pixel.x + shift, c.pixel.y);
                    c.id == corner.id && at.distance(corner.pixel) < 1.0
                })
            })
        };
        assert!(fits(&left, 0.0) || fits(&right, 320.0), "pair {k}: corners of both boards");
        let second = |r: &truedepth::detect::Reject| r.reason == Reason::SecondLattice;
        assert!(seen.rejects.iter().any(second), "pair {k}: {:?}", seen.rejects);
    }
}

#[test]
fn nothing_is_found_where_nothing_is() {
    let detector = Detector::new(&board(PAPER));
    let mut state = 1_u64;
    let mut random = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as u8
    };
    let image = |width: usize, height: usize, f: &mut dyn FnMut(usize, usize) -> u8| {
        let pixels = (0..width * height).map(|i| f(i % width, i / width)).collect();
        Gray::new(width, height, pixels)
    };
    let images = [
        ("black", image(640, 480, &mut |_, _| 0)),
        ("white", image(640, 480, &mut |_, _| 255)),
        ("noise", image(640, 480, &mut |_, _| random())),
        (
            "checkerboard",
            image(640, 480, &mut |x, y| if (x / 40 + y / 40) % 2 == 0 { 30 } else { 220 }),
        ),
        (
            "fine checkerboard",
            image(640, 480, &mut |x, y| if (x / 9 + y / 9) % 2 == 0 { 30 } else { 220 }),
        ),
        ("pixel checkerboard", image(640, 480, &mut |x, y| if (x + y) % 2 == 0 { 0 } else { 255 })),
        ("blinds", image(640, 480, &mut |_, y| if y / 11 % 2 == 0 { 30 } else { 220 })),
        (
            "bricks",
            image(640, 480, &mut |x, y| {
                let mortar = y % 24 < 3 || (x + y / 24 % 2 * 30) % 60 < 3;
                if mortar { 200 } else { 90 }
            }),
        ),
        (
            "keyboard",
            image(640, 480, &mut |x, y| {
                let key = x % 32 > 3 && y % 32 > 3;
                let glyph = x % 32 > 10 && x % 32 < 22 && y % 32 > 10 && y % 32 < 22;
                if !key {
                    20
                } else if glyph {
                    (x * 7 + y * 13 + x / 32 * 91 + y / 32 * 57) as u8
                } else {
                    210
                }
            }),
        ),
        ("1x1", image(1, 1, &mut |_, _| 9)),
        ("2x480", image(2, 480, &mut |_, y| y as u8)),
        ("empty", Gray::new(0, 0, Vec::new())),
    ];
    for (name, image) in images {
        let seen = detector.detect(&image);
        assert!(seen.corners.is_empty() && seen.identity.is_none(), "{name}: {:?}", seen.identity);
    }
}

#[test]
fn no_corner_is_invented_on_the_real_recordings() {
    let Some(root) = crate::data("zeiss") else { return };
    let truth: serde_json::Value =
        serde_json::from_slice(&fs::read(root.join("truth.json")).expect("truth.json"))
            .expect("JSON");
    let detector = Detector::new(&board(PAPER));
    let (mut found, mut all) = (0, 0);
    let mut missed = Vec::new();
    for (path, frame) in truth.as_object().expect("an object") {
        let bytes = fs::read(root.join(path)).expect(path);
        let seen = detector.detect(&Gray::from_png(&bytes, &Limits::default()).expect(path));
        let corners = |key: &str| -> BTreeMap<usize, Pixel> {
            let Some(map) = frame[key].as_object() else { return BTreeMap::new() };
            map.iter()
                .map(|(id, at)| {
                    let coordinate = |k: usize| at[k].as_f64().expect("a number");
                    (id.parse().expect("an id"), Pixel::new(coordinate(0), coordinate(1)))
                })
                .collect()
        };
        let (required, optional) = (corners("corners"), corners("optional"));
        let tolerance = if frame["quality"] == "blurred" { 3.0 } else { 1.5 };
        all += required.len();
        for corner in &seen.corners {
            if let Some(at) = required.get(&corner.id) {
                let distance = corner.pixel.distance(*at);
                assert!(
                    distance <= tolerance,
                    "{path}: corner {} is {distance:.2} px off",
                    corner.id
                );
                found += 1;
            } else {
                let near =
                    optional.get(&corner.id).is_some_and(|at| corner.pixel.distance(*at) <= 3.0);
                assert!(near, "{path}: corner {} is not there", corner.id);
            }
        }
        if seen.corners.is_empty() {
            missed.push(path.clone());
        }
    }
    let recall = f64::from(found) / all as f64;
    println!("{found} of {all} corners ({:.2} %), no board in {missed:?}", 100.0 * recall);
    assert!(recall >= 0.97, "{found} of {all}");
}
