//! truedepth beside `calib-targets-charuco`, one thread, same images, alternating; the best of five runs per image.
//!
//!     cargo run --release --manifest-path bench/rivals/Cargo.toml -- ../shared/data/realsense-handeye/intrinsics_gray/*.png
//!
//! The board is that of these images: `calib-targets-charuco` does not know the old layout of the paper's board.

use std::{env, fs, time::Instant};

use calib_targets::{
    aruco::builtins,
    charuco::{CharucoBoardSpec, CharucoParams, MarkerLayout},
    detect,
};
use truedepth::{
    board::CharucoBoard,
    detect::Detector,
    image::{Gray, Limits},
};

const RUNS: usize = 5;

fn main() {
    let spec = CharucoBoardSpec::new(5, 7, 30.0, 0.7, builtins::DICT_4X4_50)
        .with_marker_layout(MarkerLayout::OpenCvCharuco);
    let params = CharucoParams::for_board(spec);
    let board: CharucoBoard =
        "7x5:30mm:21mm:4X4_50".parse().expect("a board that can be");
    let detector = Detector::new(&board);
    let (mut n, mut ours_ms, mut theirs_ms) = (0, 0.0, 0.0);
    let (mut our_corners, mut their_corners) = (0, 0);
    for path in env::args().skip(1) {
        let gray = Gray::from_png(&fs::read(&path).expect("a readable file"), &Limits::default())
            .expect("a PNG");
        let (width, height) = (gray.width() as u32, gray.height() as u32);
        let same = image::GrayImage::from_raw(width, height, gray.pixels().to_vec())
            .expect("as many pixels");
        let (mut ours, mut theirs) = (f64::INFINITY, f64::INFINITY);
        let (mut a, mut b) = (0, 0);
        for _ in 0..RUNS {
            let start = Instant::now();
            a = detector.detect(&gray).corners.len();
            ours = ours.min(1e3 * start.elapsed().as_secs_f64());
            let start = Instant::now();
            b = detect::detect_charuco(&same, &params).map_or(0, |found| found.corners.len());
            theirs = theirs.min(1e3 * start.elapsed().as_secs_f64());
        }
        n += 1;
        ours_ms += ours;
        theirs_ms += theirs;
        our_corners += a;
        their_corners += b;
    }
    println!("{n} images");
    println!("truedepth               {:.3} ms per image, {our_corners} corners", ours_ms / f64::from(n));
    println!("calib-targets-charuco   {:.3} ms per image, {their_corners} corners", theirs_ms / f64::from(n));
}
