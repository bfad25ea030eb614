//! The detector alone, on one thread: `cargo bench --bench detect`.
//!
//! Pictures are simulated, so that anybody can run it; `bench/compare.py` measures real frames beside OpenCV.

use divan::{Bencher, black_box};
use truedepth::{
    board::CharucoBoard,
    camera::{Camera, Distortion, Intrinsics},
    detect::Detector,
    geom::{Pose, Rotation, Vector3},
    image::Gray,
    simulate::{Motion, Noise, Scene, render},
};

fn main() {
    divan::main();
}

fn board() -> CharucoBoard {
    "10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL".parse().expect("a board that can be")
}

/// The tilted board in an image `width` pixels wide, moved while the shutter was open.
fn picture(width: usize, motion_px: f64) -> Gray {
    let height = width * 3 / 4;
    let fx = 590.0 * width as f64 / 640.0;
    let (cx, cy) = (width as f64 / 2.0, height as f64 / 2.0);
    let camera = Camera {
        intrinsics: Intrinsics { fx, fy: fx, cx, cy, width, height },
        distortion: Distortion::None,
    };
    let rotation =
        Rotation::from_euler_angles(0.3, -0.25, 0.0) * Rotation::from_euler_angles(0.0, 0.0, 0.3);
    let middle = Vector3::new(0.104, 0.0835, 0.0);
    let color_from_board = Pose::new(rotation, Vector3::new(0.0, 0.0, 0.32) - rotation * middle);
    let mut scene = Scene::ideal(board(), camera, color_from_board);
    scene.motion =
        Motion { translation_m: Vector3::new(motion_px * 0.32 / fx, 0.0, 0.0), ..Motion::NONE };
    scene.blur_sigma_px = 0.8 * (width as f64 / 640.0).max(1.0);
    scene.noise = Noise::Gray { sigma: 2.0 };
    render(&scene, 1).gray()
}

fn detect(bencher: Bencher<'_, '_>, image: &Gray) {
    let detector = Detector::new(&board());
    bencher.bench_local(|| detector.detect(black_box(image)));
}

/// Cost in proportion to pixels.
#[divan::bench(args = [320, 640, 1280, 2560, 4032])]
fn width_px(bencher: Bencher<'_, '_>, width: usize) {
    detect(bencher, &picture(width, 0.0));
}

/// Motion, in a 640 x 480 picture.
#[divan::bench(args = [0, 4, 8, 16])]
fn motion_px(bencher: Bencher<'_, '_>, motion_px: u32) {
    detect(bencher, &picture(640, f64::from(motion_px)));
}

/// 640 x 480 pixels of what is no board.
#[divan::bench(args = ["noise", "checkerboard", "blinds"])]
fn no_board(bencher: Bencher<'_, '_>, what: &str) {
    let mut state = 1_u64;
    let pixel = |i: usize| {
        let (x, y) = (i % 640, i / 640);
        match what {
            "checkerboard" => [30, 220][(x / 40 + y / 40) % 2],
            "blinds" => [30, 220][y / 11 % 2],
            _ => {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (state >> 56) as u8
            }
        }
    };
    detect(bencher, &Gray::new(640, 480, (0..640 * 480).map(pixel).collect()));
}
