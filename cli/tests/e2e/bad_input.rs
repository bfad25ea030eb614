//! Files that are not what they should be: exit code 1, a message that names the file and the remedy, no report.

use std::{fs, path::Path};

use crate::{
    Run,
    scratch::{Scratch, files_of, zip},
    truedepth,
};

/// Audits, and expects a refusal that says these words.
#[track_caller]
fn refused(recording: &Path, words: &[&str]) {
    let out = Scratch::new();
    let report = out.join("report");
    let run =
        truedepth(["audit".as_ref(), recording.as_os_str(), "-o".as_ref(), report.as_os_str()]);
    let run = run.code(1).says(&["error: "]).says(words);
    assert!(run.stdout.is_empty(), "{run:#?}");
    assert!(!report.exists(), "nothing is written where nothing was found out");
    for debug in ["Error {", "Err(", "Some(", "Os {", "\\\""] {
        assert!(!run.stderr.contains(debug), "`{debug}` is no word for people: {run:#?}");
    }
}

/// Changes a file of a blank recording and expects a refusal.
#[track_caller]
fn refused_after(file: &str, change: impl FnOnce(Vec<u8>) -> Vec<u8>, words: &[&str]) {
    let scratch = Scratch::new();
    let recording = scratch.blank_recording("rec");
    let path = recording.join(file);
    let bytes = change(fs::read(&path).expect("the recording has this file"));
    fs::write(&path, bytes).expect("it can be written");
    refused(&recording, words);
}

fn replaced(bytes: Vec<u8>, what: &str, by: &str) -> Vec<u8> {
    let text = String::from_utf8(bytes).expect("metadata is text");
    assert!(text.contains(what), "{what} is not in {text}");
    text.replacen(what, by, 1).into_bytes()
}

#[test]
fn nothing_there() {
    let scratch = Scratch::new();
    refused(&scratch.join("nowhere"), &["nowhere", "check that it is there"]);
}

#[test]
fn an_empty_folder() {
    let scratch = Scratch::new();
    let name = scratch.path().display().to_string();
    refused(scratch.path(), &[&name, "is not a recording", "give the folder"]);
}

#[test]
fn not_a_recording() {
    let scratch = Scratch::new();
    let text = scratch.write("notes.txt", "hello");
    refused(scratch.path(), &["is not a recording", "give the folder"]);
    refused(&text, &["notes.txt", "is not a recording", "give the folder"]);
}

#[test]
fn a_truncated_png() {
    let half = |mut bytes: Vec<u8>| {
        bytes.truncate(bytes.len() / 2);
        bytes
    };
    refused_after("rgb_1500.png", half, &["rgb_1500.png", "truncated"]);
    refused_after("rgb_1500.png", |_| Vec::new(), &["rgb_1500.png"]);
    refused_after("rgb_1500.png", |_| b"not a picture".to_vec(), &["rgb_1500.png"]);
}

#[test]
fn depth_of_another_size_than_the_metadata_says() {
    let wider = |bytes| replaced(bytes, "\"Width\" : 64", "\"Width\" : 128");
    refused_after("DepthMetadata.json", wider, &["png", "64x48", "128x48", "DepthMetadata.json"]);
}

#[test]
fn metadata_cut_in_the_middle_of_a_record() {
    let cut = |mut bytes: Vec<u8>| {
        bytes.truncate(bytes.len() - 40);
        bytes
    };
    refused_after("DepthMetadata.json", cut, &["DepthMetadata.json", "record 3", "again"]);
}

#[test]
fn a_number_that_is_none() {
    for (what, by) in [
        ("(50.0, 0.0, 31.5)", "(nan, 0.0, 31.5)"),
        ("(50.0, 0.0, 31.5)", "(inf, 0.0, 31.5)"),
        ("(50.0, 0.0, 31.5)", "(-50.0, 0.0, 31.5)"),
        ("(50.0, 0.0, 31.5)", "hello"),
        ("\"Width\" : 64", "\"Width\" : \"wide\""),
        ("\"Timestamp\" : 1500", "\"Timestamp\" : NaN"),
    ] {
        refused_after(
            "DepthMetadata.json",
            |b| replaced(b, what, by),
            &["DepthMetadata.json", "record"],
        );
    }
}

#[test]
fn a_board_without_a_unit() {
    let bare = |bytes| replaced(bytes, "20.875mm", "20.875");
    refused_after("board.toml", bare, &["board.toml", "unit"]);
    let scratch = Scratch::new();
    let recording = scratch.blank_recording("rec");
    let run = |board: &str| {
        let report = scratch.join("report");
        truedepth([
            "audit".as_ref(),
            recording.as_os_str(),
            "--board".as_ref(),
            board.as_ref(),
            "-o".as_ref(),
            report.as_os_str(),
        ])
    };
    run("10x8:20.875:10.4375:ARUCO_ORIGINAL").code(2).says(&["20.875", "unit"]);
    run("10x8:20.875mm").code(2).says(&["10x8:20.875mm", "10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL"]);
    run("10x8").code(1).says(&["10x8", "hint: --board takes"]);
    run("nowhere.toml").code(1).says(&["nowhere.toml"]);
}

#[test]
fn no_board_known() {
    let scratch = Scratch::new();
    let recording = scratch.blank_recording("rec");
    fs::remove_file(recording.join("board.toml")).expect("it was there");
    refused(&recording, &["board", "--board 10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL"]);
}

#[test]
fn a_zip_that_leads_out() {
    let scratch = Scratch::new();
    let recording = scratch.blank_recording("rec");
    let files = files_of(&recording, "../rec/");
    let files: Vec<_> = files.iter().map(|(n, b)| (n.as_str(), b.as_slice())).collect();
    let path = scratch.write("out.zip", zip(&files));
    refused(&path, &["out.zip", "../rec/", "leads out"]);
    assert!(!scratch.join("out").exists());
}

#[test]
fn a_zip_bomb() {
    let scratch = Scratch::new();
    let recording = scratch.blank_recording("rec");
    let mut files = files_of(&recording, "");
    let bomb = vec![0; (64 << 20) + 1];
    for (name, bytes) in &mut files {
        if name == "rgb_1500.png" {
            bytes.clone_from(&bomb);
        }
    }
    let files: Vec<_> = files.iter().map(|(n, b)| (n.as_str(), b.as_slice())).collect();
    let path = scratch.write("bomb.zip", zip(&files));
    assert!(fs::metadata(&path).expect("written").len() < 1 << 20, "it is small");
    refused(&path, &["bomb.zip", "rgb_1500.png", "limit", "hint: --trust"]);
}

#[test]
fn a_zip_that_is_cut() {
    let scratch = Scratch::new();
    let recording = scratch.blank_recording("rec");
    let files = files_of(&recording, "");
    let files: Vec<_> = files.iter().map(|(n, b)| (n.as_str(), b.as_slice())).collect();
    let bytes = zip(&files);
    let path = scratch.write("cut.zip", &bytes[..bytes.len() / 2]);
    refused(&path, &["cut.zip", "copy it again"]);
}

/// Root may read everything, so a file without the right to it is played by a folder under the file's name.
#[test]
fn an_unreadable_file() {
    for file in ["rgb_1500.png", "DepthMetadata.json"] {
        let scratch = Scratch::new();
        let recording = scratch.blank_recording("rec");
        fs::remove_file(recording.join(file)).expect("it was there");
        fs::create_dir(recording.join(file)).expect("it is gone");
        refused(&recording, &[file, "check that it is there, and that"]);
    }
}

#[cfg(unix)]
#[test]
fn a_link_to_nowhere() {
    let scratch = Scratch::new();
    let recording = scratch.blank_recording("rec");
    fs::remove_file(recording.join("depth_1500.png")).expect("it was there");
    std::os::unix::fs::symlink("/nowhere/at/all", recording.join("depth_1500.png"))
        .expect("a link");
    // A blank recording has no corner to read depth at, so this may go unnoticed; it must not crash.
    let run: Run = truedepth(["audit".as_ref(), recording.as_os_str(), "--json".as_ref()]);
    assert!(matches!(run.code, Some(0 | 1 | 3)), "{run:#?}");
}

#[test]
fn no_board_in_any_frame_is_a_report() {
    let scratch = Scratch::new();
    let recording = scratch.blank_recording("rec");
    let report = scratch.join("report");
    let run =
        truedepth(["audit".as_ref(), recording.as_os_str(), "-o".as_ref(), report.as_os_str()]);
    assert!(matches!(run.code, Some(0 | 3)), "{run:#?}");
    let json = fs::read_to_string(report.join("report.json")).expect("a report");
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(json["n_frames_with_board"], 0);
    let focal = json["findings"]
        .as_array()
        .expect("findings")
        .iter()
        .find(|finding| finding["code"] == "TD201")
        .expect("a finding about the focal length");
    assert_eq!(focal["verdict"], "unknown", "{focal}");
    assert!(report.join("report.html").exists());
}
