//! The library from outside: one binary, one module per subject.
//!
//! Tests on real recordings ask [`data`] for them and end early, saying so, where the folder is absent.

mod calibrate;
mod correct;
mod coverage;
mod detect;
mod detect_any;
mod measure;
mod order;
mod photos;
mod real_alignment;
mod real_audit;
mod recording;
mod reproduce;
mod sheet;
mod tidy;

use std::{
    env,
    io::Write,
    path::{Path, PathBuf},
};

/// A file or folder of the shared data: `../shared/data` beside the repository, or where `TRUEDEPTH_DATA` says.
///
/// Where that variable is not set and the whole folder is absent the answer is `None`, and one line on stderr says
/// what was skipped. With `TRUEDEPTH_DATA=required`, or a path, an absent folder fails the test, as does a file that is
/// not in the folder: a misspelt name must not pass as "absent".
fn data(relative: &str) -> Option<PathBuf> {
    let told = env::var_os("TRUEDEPTH_DATA");
    let root = told.as_ref().filter(|told| *told != "required").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    if !root.is_dir() {
        assert!(told.is_none(), "TRUEDEPTH_DATA is set, and {} is not a folder", root.display());
        let test = std::thread::current().name().unwrap_or("a test").to_owned();
        // Written past the harness, which would swallow the output of a test that passes.
        writeln!(std::io::stderr(), "skipped: {test}: {} absent", root.display()).ok();
        return None;
    }
    let path = root.join(relative);
    assert!(path.exists(), "{} is not in the data folder", path.display());
    Some(path)
}
