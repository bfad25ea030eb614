//! How long the least squares take: corners from a file of `tests/golden/opencv/calibrate.py`, seconds per model on
//! stdout as JSON. `bench/calibrate.py` runs it beside OpenCV.
//!
//!     cargo run --release --example calibrate_speed -- views.json

use std::{env, error::Error, fs, time::Instant};

use truedepth::{
    board::CharucoBoard,
    calibrate::{FrameCorners, Input, Method, Model, calibrate},
    camera::Intrinsics,
    detect::Corner,
    geom::Pixel,
};

/// The least of so many runs is reported.
const RUNS: usize = 20;

#[allow(clippy::print_stdout, reason = "the result of a program")]
fn main() -> Result<(), Box<dyn Error>> {
    let file = env::args().nth(1).ok_or("name a file of calibrate.py")?;
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
