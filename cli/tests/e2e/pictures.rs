//! `truedepth overlay` and `undistort`: which pictures are written, what is said, and what is never written over.

use std::{ffi::OsStr, fs};

use truedepth::{files::Limits, image::Rgb};

use crate::{
    scratch::{Scratch, files_of, names},
    truedepth,
};

/// The verb on a recording, into a folder, with more arguments.
fn args<'a>(
    verb: &'a str,
    recording: &'a OsStr,
    out: &'a OsStr,
    more: &[&'a str],
) -> Vec<&'a OsStr> {
    let mut args = vec![verb.as_ref(), recording, "-o".as_ref(), out];
    args.extend(more.iter().copied().map(OsStr::new));
    args
}

#[test]
fn depth_over_colour() {
    let scratch = Scratch::new();
    let recording = scratch.blank_recording("rec");
    let out = scratch.join("deep/pictures");
    let run = truedepth(args("overlay", recording.as_os_str(), out.as_os_str(), &[])).code(0);
    assert!(run.stdout.contains("3 pictures, sheet.png"), "{run:?}");
    assert!(run.stdout.contains("colours from 300 to 310 mm"), "{run:?}");
    assert_eq!(
        names(&out),
        ["overlay_1000.png", "overlay_1500.png", "overlay_2000.png", "sheet.png"]
    );
    let png = fs::read(out.join("overlay_1000.png")).unwrap();
    let one = Rgb::from_png(&png, &Limits::default().image).unwrap();
    assert!(one.width() > 1280 && one.height() > 960, "{}x{}", one.width(), one.height());

    // Before and after, one frame, an animation, JSON: the same frames again are the same bytes.
    let pair = |name: &str, threads: &str| {
        let out = scratch.join(name);
        let more = [
            "--frames",
            "1",
            "--fault",
            "depth-zoom=0.9",
            "--animate",
            "--json",
            "--threads",
            threads,
        ];
        let run = truedepth(args("overlay", recording.as_os_str(), out.as_os_str(), &more)).code(0);
        let value: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
        assert_eq!(value["schema"], "truedepth.overlay/1");
        assert_eq!(value["steps"][0]["defect"]["kind"], "depth-zoom");
        assert_eq!(value["frames"][0]["id"], "1500");
        let holes = &value["frames"][0]["holes"];
        assert_eq!(holes[0], 0.0);
        assert!(holes[1].as_f64().unwrap() > 0.15, "{holes}");
        assert_eq!(names(&out), ["overlay.apng", "overlay_1500.png"]);
        files_of(&out, "")
    };
    assert_eq!(pair("one", "1"), pair("two", "2"));

    // Beside a recording that was corrected.
    let fixed = scratch.join("fixed");
    truedepth(args("correct", recording.as_os_str(), fixed.as_os_str(), &["--fault", "mirrored"]))
        .code(0);
    let out = scratch.join("beside");
    let more = ["--with", fixed.to_str().unwrap(), "--edges", "--flip"];
    let run = truedepth(args("overlay", recording.as_os_str(), out.as_os_str(), &more)).code(0);
    assert!(run.stdout.contains("before, 0.0 % after"), "{run:?}");
}

#[test]
fn overlay_refuses_what_it_cannot_draw() {
    let scratch = Scratch::new();
    let recording = scratch.blank_recording("rec");
    let rec = recording.as_os_str();
    let out = scratch.join("out");
    let run = |more: &[&str], code: i32, words: &[&str]| {
        truedepth(args("overlay", rec, out.as_os_str(), more)).code(code).says(words);
        assert!(!out.exists(), "{more:?}");
    };
    run(&["--frames", "3"], 1, &["3 frames, 0 to 2", "no frame 3"]);
    run(&["--frames", "x"], 2, &["0,4,10-19"]);
    run(&["--range", "150..400"], 2, &["150mm..400mm"]);
    run(&["--opacity", "2"], 2, &["0% to 100%"]);
    run(&["--audit", "--fault", "mirrored"], 2, &["--audit"]);
    run(&["--with", "/nowhere.json"], 1, &["/nowhere.json"]);
    run(&["--fault", "distorted"], 1, &["lookup tables"]);
    truedepth(args("overlay", rec, rec, &[])).code(1).says(&["lie in each other"]);
    fs::create_dir(&out).unwrap();
    scratch.write("out/mine.txt", "mine");
    truedepth(args("overlay", rec, out.as_os_str(), &[])).code(1).says(&["not empty"]);
    assert_eq!(names(&out), ["mine.txt"]);

    // Without any depth, and with depth of another size.
    for name in ["depth_1000.png", "depth_1500.png", "depth_2000.png"] {
        fs::remove_file(recording.join(name)).unwrap();
    }
    let new = scratch.join("new");
    truedepth(args("overlay", rec, new.as_os_str(), &[])).code(1).says(&[
        "none of the 3 frames",
        "a depth image",
        "copy the depth_*.png",
    ]);
    assert!(!new.exists());
}

#[test]
fn a_frame_without_depth_is_left_out_and_said() {
    let scratch = Scratch::new();
    let recording = scratch.blank_recording("rec");
    fs::remove_file(recording.join("depth_1500.png")).unwrap();
    let out = scratch.join("out");
    let run = truedepth(args("overlay", recording.as_os_str(), out.as_os_str(), &[])).code(0);
    assert!(run.stdout.contains("frames 1") && run.stdout.contains("2 pictures"), "{run:?}");
    assert_eq!(names(&out), ["overlay_1000.png", "overlay_2000.png", "sheet.png"]);
}

/// A simulated iPad whose images are as its lens drew them, and one whose images are straight.
#[test]
fn the_lens_side_by_side() {
    let scratch = Scratch::new();
    for (fault, state, words) in
        [("distorted", "distorted", "Not rectified"), ("focal=1%", "rectified", "Already straight")]
    {
        let (rec, out) = (scratch.join(state), scratch.join(&format!("{state}-out")));
        truedepth([
            "simulate",
            "--device",
            "ipad-12.9-5gen",
            "--frames",
            "6",
            "--fault",
            fault,
            "-q",
            "-o",
            rec.to_str().unwrap(),
        ])
        .code(0);
        let run =
            truedepth(args("undistort", rec.as_os_str(), out.as_os_str(), &["--json"])).code(0);
        let value: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
        assert_eq!(
            (&value["schema"], &value["state"]),
            (&"truedepth.undistort/1".into(), &state.into()),
            "{value}"
        );
        assert_eq!(value["lens"], "tables");
        assert_eq!(names(&out).len(), 6);
        let again = scratch.join(&format!("{state}-again"));
        let run =
            truedepth(args("undistort", rec.as_os_str(), again.as_os_str(), &["--every", "1"]))
                .code(0);
        assert!(run.stdout.contains(words), "{run:?}");
    }
}

#[test]
fn without_tables_it_says_what_to_do() {
    let scratch = Scratch::new();
    let recording = scratch.blank_recording("rec");
    let out = scratch.join("out");
    truedepth(args("undistort", recording.as_os_str(), out.as_os_str(), &[]))
        .code(1)
        .says(&["no lens distortion tables", "--with lens.json"]);
    let pinhole = scratch.write("pinhole.json", "{}");
    let more = ["--with", pinhole.to_str().unwrap()];
    truedepth(args("undistort", recording.as_os_str(), out.as_os_str(), &more))
        .code(1)
        .says(&["pinhole.json", "calibrate"]);
    assert!(!out.exists());
}
