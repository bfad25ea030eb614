//! `truedepth correct`, `inspect`, `compare`: what is written, and what never is.

use std::{ffi::OsStr, fs, process::Command, thread, time::Duration};

use crate::{
    scratch::{Scratch, files_of, names},
    truedepth,
};

#[test]
fn a_correction_is_a_new_recording_with_provenance() {
    let scratch = Scratch::new();
    let recording = scratch.blank_recording("rec");
    fs::write(recording.join("Accelerometer.txt"), "1 2 3 4\n").unwrap();
    fs::create_dir(recording.join("notes")).unwrap();
    fs::write(recording.join("notes/a.txt"), "kept").unwrap();
    let before = files_of(&recording.join("notes"), "");
    let out = scratch.join("deep/fixed");
    let run = truedepth([
        "correct".as_ref(),
        recording.as_os_str(),
        "-o".as_ref(),
        out.as_os_str(),
        "--fault".as_ref(),
        "depth-zoom=0.95".as_ref(),
        "--fault".as_ref(),
        "focal=10%".as_ref(),
        "--json".as_ref(),
    ])
    .code(0);
    let provenance = fs::read_to_string(out.join("provenance.json")).unwrap();
    assert_eq!(run.stdout, provenance);
    let value: serde_json::Value = serde_json::from_str(&provenance).unwrap();
    assert_eq!(value["schema"], "truedepth.correct/1");
    assert_eq!(value["steps"].as_array().map(Vec::len), Some(2));
    assert_eq!(value["n_frames"], 3);
    let after = value["factory_after"]["focal_xy_px"][0].as_f64().unwrap();
    assert!((after - 50.0 / 1.1).abs() < 1e-6, "{after}");
    assert_eq!(files_of(&out.join("notes"), ""), before);
    assert_eq!(fs::read_to_string(out.join("Accelerometer.txt")).unwrap(), "1 2 3 4\n");
    // Colour is not touched by either step.
    assert_eq!(
        fs::read(out.join("rgb_1000.png")).unwrap(),
        fs::read(recording.join("rgb_1000.png")).unwrap()
    );
    assert_eq!(names(&scratch.join("deep")), ["fixed"], "no temporary folder stays behind");

    // Once more: the first provenance is inside the second.
    let again = scratch.join("again");
    truedepth([
        "correct".as_ref(),
        out.as_os_str(),
        "-o".as_ref(),
        again.as_os_str(),
        "--fault".as_ref(),
        "depth-bias=2mm".as_ref(),
    ])
    .code(0);
    let text = fs::read_to_string(again.join("provenance.json")).unwrap();
    let second: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(second["previous"], value);
}

/// What is significant though within the tolerance is said, and corrected when asked for.
#[test]
fn within_the_tolerance_only_when_asked() {
    let scratch = Scratch::new();
    let (rec, out) = (scratch.join("rec"), scratch.join("out"));
    let device = "ipad-12.9-5gen";
    let simulate = [
        "simulate",
        "--device",
        device,
        "--fault",
        "depth-bias=2mm",
        "--frames",
        "14",
        "--seed",
        "3",
    ];
    truedepth(simulate.into_iter().map(OsStr::new).chain(["-o".as_ref(), rec.as_os_str()])).code(0);
    let report = scratch.join("report");
    let as_text = |path: &std::path::Path| path.to_str().expect("a plain name").to_owned();
    truedepth(["audit", &as_text(&rec), "-o", &as_text(&report)]).code(0);
    let json = as_text(&report.join("report.json"));
    let correct = |more: &[&str]| {
        let (rec, out) = (as_text(&rec), as_text(&out));
        let words = ["correct", &rec, "-o", &out, "--with", &json];
        truedepth(words.iter().chain(more).map(|word| (*word).to_owned()))
    };
    correct(&[]).code(0).says(&["TD302", "--within-tolerance", "nothing to correct"]);
    correct(&["--only", "center"]).code(0).says(&["nothing to correct"]);
    assert!(!out.exists());
    correct(&["--only", "depth", "--within-tolerance"]).code(2);
    let run = correct(&["--within-tolerance"]).code(0);
    assert!(run.stdout.contains("depth-bias=") && run.stdout.contains("TD302"), "{}", run.stdout);
}

#[test]
fn never_in_place_and_never_over_anything() {
    let scratch = Scratch::new();
    let recording = scratch.blank_recording("rec");
    let before = files_of(&recording, "");
    fs::create_dir(scratch.join("full")).unwrap();
    scratch.write("full/mine.txt", "mine");
    scratch.write("file", "mine");
    for (out, words) in [
        ("rec", "lie in each other"),
        ("rec/inside", "lie in each other"),
        (".", "lie in each other"),
        ("full", "not empty"),
        ("file", "there already"),
    ] {
        let out = scratch.join(out);
        truedepth([
            "correct".as_ref(),
            recording.as_os_str(),
            "-o".as_ref(),
            out.as_os_str(),
            "--fault".as_ref(),
            "depth-bias=2mm".as_ref(),
        ])
        .code(1)
        .says(&[words]);
    }
    let new = scratch.join("new");
    // It has no tables to rectify by: an error, and nothing is left behind.
    truedepth([
        "correct".as_ref(),
        recording.as_os_str(),
        "-o".as_ref(),
        new.as_os_str(),
        "--fault".as_ref(),
        "distorted".as_ref(),
    ])
    .code(1)
    .says(&["lookup tables", "--with"]);
    assert_eq!(files_of(&recording, ""), before);
    assert_eq!(names(scratch.path()), ["file", "full", "rec"]);
    assert_eq!(names(&scratch.join("full")), ["mine.txt"]);
}

/// `bench/kill_correct.sh` does the same a hundred times on a real recording.
#[test]
fn killed_at_any_moment_the_output_is_absent_or_whole() {
    let scratch = Scratch::new();
    let recording = scratch.blank_recording("rec");
    // Enough files for a run to be met in its midst.
    for i in 0..400 {
        fs::write(recording.join(format!("aux_{i}.bin")), vec![i as u8; 20_000]).unwrap();
    }
    let before = files_of(&recording, "");
    let out = scratch.join("out");
    let args = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_truedepth"));
        command.arg("correct").arg(&recording).arg("-o").arg(&out);
        command.args(["-q", "--fault", "depth-scale=2%"]);
        command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::null());
        command
    };
    let (mut n_absent, mut n_partial) = (0, 0);
    for i in 0..12 {
        let mut child = args().spawn().unwrap();
        thread::sleep(Duration::from_millis(3 + 7 * i));
        child.kill().unwrap();
        child.wait().unwrap();
        let left = names(scratch.path());
        n_partial += usize::from(left.iter().any(|name| name.ends_with(".partial")));
        if out.exists() {
            assert_eq!(
                names(&out).iter().filter(|name| *name != ".lock").count(),
                before.len() + 1
            );
            fs::remove_dir_all(&out).unwrap();
        } else {
            n_absent += 1;
        }
    }
    assert!(n_absent > 0 && n_partial > 0, "{n_absent} {n_partial}: no run was met in its midst");
    assert_eq!(files_of(&recording, ""), before);
    // The next run clears away what the killed ones left.
    assert!(args().status().unwrap().success());
    assert_eq!(names(scratch.path()), ["out", "rec"]);
    assert_eq!(names(&out).len(), before.len() + 1);
}

#[test]
fn inspect_and_compare() {
    let scratch = Scratch::new();
    let recording = scratch.blank_recording("rec");
    let run = truedepth(["inspect".as_ref(), recording.as_os_str(), "--json".as_ref()]).code(0);
    assert!(run.stdout.contains("\"schema\": \"truedepth.inspect/1\""));
    let run = truedepth(["compare", "ipad-12.9-5gen/ios14/av", "ipad-12.9-5gen/ios14/ar"]).code(0);
    assert!(run.stdout.contains("525.97") && run.stdout.contains("361.58"), "{run:?}");
    assert_eq!(truedepth(["compare", "--list"]).code(0).stdout.lines().count(), 20);
    truedepth(["compare", "nothing", "ipad-12.9-5gen/ios14/ar"]).code(1).says(&["--list"]);
    let mine = scratch.write(
        "mine.toml",
        "[[device]]\nname = \"x\"\nversion = \"1\"\napi = \"ar\"\nreference = [2880.0, 2160.0]\n\
         focal_px = 1900.0\ncenter_px = [1440.0, 1080.0]\n",
    );
    let run =
        truedepth(["compare".as_ref(), "--list".as_ref(), "--devices".as_ref(), mine.as_os_str()])
            .code(0);
    assert!(run.stdout.contains("x/1/ar"));
}
