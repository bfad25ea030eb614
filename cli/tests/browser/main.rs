//! The report in a real browser: it says nothing on the console, loads nothing, shows every figure with its data, and
//! answers to mouse, touch and keyboard. Screenshots go to `target/browser/`; look at them.
//!
//! Chromium and chromedriver are looked for in the PATH; without them the tests say `skipped: ...` and pass, unless
//! `TRUEDEPTH_BROWSER=required` is set, as `.ci/run` does.

#![allow(clippy::print_stdout, reason = "a test that is skipped says so")]

mod driver;
mod interaction;
mod page;

use std::{
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use driver::Browser;

/// A browser, or the word that there is none.
fn browser() -> Option<Browser> {
    match Browser::start() {
        Ok(browser) => Some(browser),
        Err(missing) => {
            let required =
                std::env::var("TRUEDEPTH_BROWSER").is_ok_and(|value| value == "required");
            assert!(!required, "{missing}: apt-get install chromium chromium-driver");
            println!("skipped: {missing}");
            None
        }
    }
}

/// A folder for screenshots and reports.
fn folder() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("../browser");
    std::fs::create_dir_all(&folder).expect("target/ can be written");
    folder.canonicalize().expect("it was made just now")
}

/// Runs `truedepth`; any exit code but "could not run" will do.
#[track_caller]
fn truedepth(args: &[&str]) {
    let run =
        Command::new(env!("CARGO_BIN_EXE_truedepth")).args(args).stdin(Stdio::null()).output();
    let run = run.expect("the binary was built");
    let said = String::from_utf8_lossy(&run.stderr);
    assert!(matches!(run.status.code(), Some(0 | 3)), "{args:?}: {said}");
}

/// The report of a simulated tablet with a wrong focal length and a wrong depth scale, in a folder of this name.
fn simulated_report(name: &str) -> PathBuf {
    let folder = folder().join(name);
    std::fs::remove_dir_all(&folder).ok();
    let recording = folder.join("ipad");
    let recording = recording.to_str().expect("UTF-8");
    let report = folder.join("report");
    truedepth(&[
        "simulate",
        "--device",
        "ipad-12.9-5gen",
        "--fault",
        "focal=6.6%",
        "--fault",
        "depth-scale=1.5%",
        "--frames",
        "14",
        "-o",
        recording,
    ]);
    truedepth(&["audit", recording, "-o", report.to_str().expect("UTF-8")]);
    report.join("report.html")
}

/// Real recordings, where this machine has them; `TRUEDEPTH_DATA` as for the library's tests (`tests/it/main.rs`).
fn real_recordings() -> Option<PathBuf> {
    let told = std::env::var_os("TRUEDEPTH_DATA");
    let data = told.as_ref().filter(|told| *told != "required").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"),
        PathBuf::from,
    );
    let recordings = data.join("zeiss/FrontCamCalibrationDataset");
    if recordings.is_dir() {
        return Some(recordings);
    }
    assert!(told.is_none(), "TRUEDEPTH_DATA is set, and {} is not there", recordings.display());
    println!("skipped: no real recordings at {}", recordings.display());
    None
}
