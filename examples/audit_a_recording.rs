//! Is the depth of a recording true? `cargo run --release --example audit_a_recording -- RECORDING`

use std::{env, error::Error};

use truedepth::{
    audit::{Options, audit},
    files::Limits,
    measure::{Method, Silent},
    recording::Recording,
};

#[allow(clippy::print_stdout, reason = "the result of a program")]
fn main() -> Result<(), Box<dyn Error>> {
    let path = env::args_os().nth(1).ok_or("usage: audit_a_recording RECORDING")?;
    let recording = Recording::open(path, &Limits::default())?;
    let audit = audit(&recording, &Options::new(Method::Auto), &Silent)?;
    for finding in &audit.findings {
        println!("{} {:<12} {}", finding.code, finding.verdict.name(), finding.summary());
    }
    if let Some(calibration) = &audit.calibration {
        let focal_px = calibration.focal_px();
        println!("focal length: {:.2} ± {:.2} px", focal_px.value, focal_px.sigma);
    }
    Ok(())
}
