//! The intrinsics of a camera from a folder of photographs of a board, with their standard deviations:
//! `cargo run --release --example calibrate_images -- FOLDER 10x7:24mm:15mm:5X5_250`

use std::{env, error::Error};

use truedepth::{
    board::CharucoBoard,
    calibrate::{FrameCorners, Input, Method, calibrate, guess_intrinsics},
    detect::Detector,
    files::Limits,
    recording::Recording,
};

#[allow(clippy::print_stdout, reason = "the result of a program")]
fn main() -> Result<(), Box<dyn Error>> {
    let usage = "usage: calibrate_images FOLDER COLUMNSxROWS:SQUARE:MARKER:DICTIONARY";
    let (folder, board) = (env::args().nth(1).ok_or(usage)?, env::args().nth(2).ok_or(usage)?);
    let board: CharucoBoard = board.parse()?;
    let photos = Recording::open(folder, &Limits::default())?;
    let detector = Detector::new(&board);
    let mut frames = Vec::new();
    let mut size = [0; 2];
    for frame in 0..photos.frames.len() {
        let image = photos.gray(frame)?;
        size = [image.width(), image.height()];
        frames.push(FrameCorners { frame, corners: detector.detect(&image).corners });
    }
    let start = guess_intrinsics(&board, &frames, size);
    let input = Input { board: &board, factory: &start, tables: None, frames: &frames };
    let calibration = calibrate(&input, Method::Unaided)?;
    for parameter in &calibration.parameters {
        let estimate = parameter.estimate;
        println!("{:<12} {:10.4} ± {:.4}", parameter.name, estimate.value, estimate.sigma);
    }
    println!("reprojection residuals: {:.3} px RMS", calibration.rms_px);
    Ok(())
}
