//! Where the time of `truedepth correct` goes: decoding, resampling and encoding, in milliseconds a frame on one
//! thread, as JSON. `bench/correct.py` runs it beside OpenCV.
//!
//! ```text
//! cargo run --release --example correct_speed -- RECORDING [FAULT ...]        (distorted depth-zoom=0.9507)
//! ```

use std::{error::Error, time::Instant};

use truedepth::{
    correct::{Corrector, Plan},
    files::Limits,
    recording::{Defect, Recording, encode_depth},
};

#[allow(clippy::print_stdout, reason = "the result of a program")]
fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("name a recording")?;
    let mut defects: Vec<Defect> = arguments.map(|text| text.parse()).collect::<Result<_, _>>()?;
    if defects.is_empty() {
        defects = vec![Defect::Distorted, Defect::DepthZoom { zoom: [0.9507; 2] }];
    }
    let recording = Recording::open(&path, &Limits::default())?;
    let plan = Plan::given(&defects)?;
    let corrector = Corrector::new(&recording, &plan)?;
    let [mut decode_s, mut resample_s, mut encode_s] = [0.0; 3];
    let mut n_bytes = 0;
    for index in 0..recording.frames.len() {
        let start = Instant::now();
        let (color, depth) = (recording.color(index)?, recording.depth(index)?);
        let decoded = Instant::now();
        let color = corrector.correct_color(index, color)?;
        let depth = corrector.correct_depth(index, depth)?;
        let resampled = Instant::now();
        n_bytes += color.to_png().len() + encode_depth(&depth).len();
        let encoded = Instant::now();
        decode_s += (decoded - start).as_secs_f64();
        resample_s += (resampled - decoded).as_secs_f64();
        encode_s += (encoded - resampled).as_secs_f64();
    }
    let n = recording.frames.len();
    let [decode_ms, resample_ms, encode_ms] =
        [decode_s, resample_s, encode_s].map(|seconds| 1e3 * seconds / n as f64);
    println!(
        "{{\"decode_ms\": {decode_ms:.4}, \"resample_ms\": {resample_ms:.4}, \"encode_ms\": {encode_ms:.4}, \
         \"n\": {n}, \"bytes\": {n_bytes}}}"
    );
    Ok(())
}
