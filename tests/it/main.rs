//! The library from outside: one binary, one module per subject.
//!
//! Tests on real recordings ask [`data`] for them and end early, saying so, where the folder is absent.

mod calibrate;
mod correct;
mod coverage;
mod detect;
mod detect_any;
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

/// A file or folder of the shared data (`TRUEDEPTH_DATA`, else `../shared/data` beside the repository). Where the
/// whole data folder is absent the answer is `None` and one line on stderr says what was skipped; where the folder is
/// there but the file is not, the test fails: a misspelt name must not pass as "absent".
fn data(relative: &str) -> Option<PathBuf> {
    let root = env::var_os("TRUEDEPTH_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    if !root.is_dir() {
        let test = std::thread::current().name().unwrap_or("a test").to_owned();
        // Written past the harness, which would swallow the output of a test that passes.
        writeln!(std::io::stderr(), "skipped: {test}: {} absent", root.display()).ok();
        return None;
    }
    let path = root.join(relative);
    assert!(path.exists(), "{} is not in the data folder", path.display());
    Some(path)
}
