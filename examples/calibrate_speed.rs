//! How long the least squares take: corners from a file of `tests/golden/opencv/calibrate.py`, seconds per model on
//! stdout as JSON. `bench/calibrate.py` runs it beside OpenCV.
//!
//!     cargo run --release --example calibrate_speed -- views.json
//!
//! With a board instead of a file: the whole calibration (method auto, the board's shape with it) of 40 simulated views
//! of that board in a camera of 1920 by 1440 pixels; seconds and, on Linux, the most memory the process ever had.
//!
//!     cargo run --release --example calibrate_speed -- 40x30:7mm:3.5mm:6X6_1000

use std::{env, error::Error, f64::consts::TAU, fs, time::Instant};

use truedepth::{
    board::CharucoBoard,
    calibrate::{FrameCorners, Input, Method, Model, calibrate},
    camera::{Camera, Distortion, Intrinsics},
    detect::Corner,
    geom::{Board, Color, Pixel, Point, Pose, Rotation, Vector3},
};

/// The least of so many runs is reported.
const RUNS: usize = 20;

#[allow(clippy::print_stdout, reason = "the result of a program")]
fn main() -> Result<(), Box<dyn Error>> {
    let file = env::args().nth(1).ok_or("name a file of calibrate.py, or a board")?;
    if let Ok(board) = file.parse::<CharucoBoard>() {
        return large_board(&board);
    }
    let golden: serde_json::Value = serde_json::from_str(&fs::read_to_string(file)?)?;
    let number = |value: &serde_json::Value| value.as_f64().ok_or("a number is missing");
    let at = |key: &str| number(&golden["factory"][key]);
    let factory = Intrinsics {
        fx: at("fx")?,
        fy: at("fy")?,
        cx: at("cx")?,
        cy: at("cy")?,
        width: 640,
        height: 480,
    };
    let board = CharucoBoard::paper(number(&golden["square_m"])?)?;
    let mut frames = Vec::new();
    for (frame, view) in golden["views"].as_array().ok_or("no views")?.iter().enumerate() {
        let mut corners = Vec::new();
        for corner in view.as_array().ok_or("no corners")? {
            let pixel = Pixel::new(number(&corner[1])?, number(&corner[2])?);
            corners.push(Corner { id: number(&corner[0])? as usize, pixel, sigma_px: 0.2 });
        }
        frames.push(FrameCorners { frame, corners });
    }
    let input = Input { board: &board, factory: &factory, tables: None, frames: &frames };
    let mut results = serde_json::Map::new();
    for model in [Model::Focal, Model::FocalCentre, Model::Brown] {
        let (mut seconds, mut focal_px, mut rms_px) = (f64::INFINITY, 0.0, 0.0);
        for _ in 0..RUNS {
            let start = Instant::now();
            let found = calibrate(&input, Method::Plain(model))?;
            seconds = seconds.min(start.elapsed().as_secs_f64());
            (focal_px, rms_px) = (found.focal_px().value, found.rms_px);
        }
        let result = serde_json::json!({"seconds": seconds, "fx": focal_px, "rms_px": rms_px});
        results.insert(model.name().to_owned(), result);
    }
    println!("{}", serde_json::Value::Object(results));
    Ok(())
}

/// Forty views of a board wavy by a millimetre, corners with 0.05 px of noise.
#[allow(clippy::print_stdout, reason = "the result of a program")]
fn large_board(board: &CharucoBoard) -> Result<(), Box<dyn Error>> {
    let factory =
        Intrinsics { fx: 1600.0, fy: 1600.0, cx: 961.0, cy: 718.0, width: 1920, height: 1440 };
    let truth = Intrinsics { fx: 1570.0, fy: 1570.0, ..factory };
    let camera = Camera { intrinsics: truth, distortion: Distortion::None };
    let size_m = [board.squares_x, board.squares_y].map(|n| n as f64 * board.square_m);
    let mut state = 7_u64;
    let mut uniform = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut frames = Vec::new();
    for frame in 0..40 {
        let azimuth = TAU * uniform();
        let tilt = Vector3::new(azimuth.cos(), azimuth.sin(), 0.0) * (0.2 + 0.5 * uniform());
        let turn = Rotation::from_scaled_axis(tilt);
        let middle = Vector3::new(0.5 * size_m[0], 0.5 * size_m[1], 0.0);
        let distance_m = 1.3 * size_m[0] * (1.0 + 0.5 * uniform());
        let at = Vector3::new(0.05 * (uniform() - 0.5), 0.05 * (uniform() - 0.5), distance_m);
        let pose = Pose::<Color, Board>::new(turn, at - turn * middle);
        let mut corners = Vec::new();
        for id in 0..board.n_corners() {
            let flat = board.corner(id);
            let [s, t] = [TAU * flat.x() / size_m[0], TAU * flat.y() / size_m[1]];
            let place = Point::new(flat.x(), flat.y(), 2.5e-4 * (s.sin() + (1.5 * t).cos()));
            let noise = [(); 2].map(|()| 0.05 * (-2.0 * (1.0 - uniform()).ln()).sqrt());
            let phase = TAU * uniform();
            let Some(p) = camera.project(pose * place) else { continue };
            let pixel = Pixel::new(p.x + noise[0] * phase.cos(), p.y + noise[1] * phase.sin());
            if (0.0..1919.0).contains(&pixel.x) && (0.0..1439.0).contains(&pixel.y) {
                corners.push(Corner { id, pixel, sigma_px: 0.05 });
            }
        }
        frames.push(FrameCorners { frame, corners });
    }
    let input = Input { board, factory: &factory, tables: None, frames: &frames };
    let start = Instant::now();
    let found = calibrate(&input, Method::Auto)?;
    let seconds = start.elapsed().as_secs_f64();
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).map_or("?", str::trim);
    let focal = found.focal_px();
    println!(
        "{} corners of {} views: {seconds:.2} s, {peak}; {}, focal length {:.3} +- {:.3} px (true {:.1}), {}",
        found.n_corners(),
        found.views.len(),
        found.model.name(),
        focal.value,
        focal.sigma,
        truth.fx,
        found.surface.as_ref().map_or("flat", |surface| surface.kind.name()),
    );
    Ok(())
}
