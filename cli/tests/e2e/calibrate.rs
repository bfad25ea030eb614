//! Calibrations: of recordings without reading depth, of plain images, exported.

use std::fs;

use serde_json::Value;

use crate::{scratch::Scratch, truedepth_in};

/// Twelve frames of a simulated iPad, beside them the same images alone under other names, in another order, and three
/// straight on.
fn scene() -> Scratch {
    let scratch = Scratch::new();
    let simulate = |name: &str, more: &[&str]| {
        let mut args = vec!["simulate", "-o", name, "--device", "ipad-12.9-5gen", "-q"];
        args.extend(more);
        truedepth_in(scratch.path(), args).code(0);
    };
    simulate("rec", &["--fault", "focal=6.6%", "--frames", "12"]);
    simulate("still", &["--trajectory", "fronto-parallel", "--frames", "3"]);
    let mut images: Vec<_> = fs::read_dir(scratch.join("rec"))
        .expect("was written")
        .map(|entry| entry.expect("lists").path())
        .filter(|path| path.file_name().is_some_and(|n| n.to_string_lossy().starts_with("rgb_")))
        .collect();
    images.sort();
    for (folder, backwards) in [("images", false), ("backwards", true)] {
        fs::create_dir(scratch.join(folder)).expect("can be written");
        for (i, image) in images.iter().enumerate() {
            let number = if backwards { images.len() - i } else { i };
            let to = scratch.join(folder).join(format!("{folder}-{number:03}.png"));
            fs::copy(image, to).expect("copies");
        }
    }
    // Depth is not read: what cannot be decoded does not hurt.
    for entry in fs::read_dir(scratch.join("rec")).expect("was written") {
        let path = entry.expect("lists").path();
        if path.file_name().is_some_and(|n| n.to_string_lossy().starts_with("depth_")) {
            fs::write(path, "no depth").expect("can be written");
        }
    }
    scratch
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

const BOARD: &str = "10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL";

#[test]
fn calibrates_recordings_and_images() {
    let scratch = scene();
    let run = |args: &[&str]| {
        let mut all = vec!["calibrate"];
        all.extend(args);
        truedepth_in(scratch.path(), all)
    };
    // One thread or two, the same bytes.
    let one = run(&["rec", "--json", "--threads", "1"]).code(0);
    assert_eq!(one.stdout, run(&["rec", "--json", "--threads", "2"]).code(0).stdout);
    let found = json(&one.stdout);
    assert_eq!(found["schema"], "truedepth.calibrate/1");
    let focal = found["focal_px"]["value"].as_f64().expect("a number");
    assert!((focal / 530.0 - 1.0).abs() < 0.01, "{focal}");
    let grid = &found["projection_uncertainty"];
    assert_eq!((&grid["columns"], &grid["rows"]), (&Value::from(17), &Value::from(13)));
    assert_eq!(grid["sigma_px"].as_array().map(Vec::len), Some(17 * 13));
    assert!(found["candidates"][0]["held_out_sigma_px"].is_number());
    assert!(found["left_out"].as_array().is_some_and(|l| l.len() > 3));

    // A model that was asked for; the table for people.
    let table = run(&["rec", "--model", "focal+centre"]).code(0).stdout;
    for word in ["focal+centre", "two halves", "each left out", "boards tried", "projection"] {
        assert!(table.contains(word), "`{word}` is missing: {table}");
    }
    run(&["rec", "--model", "spline"]).code(2).says(&["brown+aspect"]);
    run(&["rec", "--plain"]).code(2).says(&["--model"]);

    // Images of which nothing is known; neither order nor names matter.
    run(&["images"]).code(1).says(&["--board"]);
    let focal_of = |folder: &str, more: &[&str]| {
        let mut args = vec![folder, "--board", BOARD, "--json"];
        args.extend(more);
        json(&run(&args).code(0).stdout)["focal_px"]["value"].as_f64().expect("a number")
    };
    let (forwards, backwards) = (focal_of("images", &[]), focal_of("backwards", &[]));
    assert!((forwards - backwards).abs() < 1e-4 * forwards, "{forwards} {backwards}");
    assert!((forwards / focal - 1.0).abs() < 0.005, "{forwards} {focal}");
    let plain = focal_of("images", &["--model", "focal+centre", "--plain"]);
    assert!((plain / focal - 1.0).abs() < 0.01, "{plain}");

    // Straight at the board there is no focal length, and it says what to record.
    run(&["still"]).code(1).says(&["cannot tell", "hint: record", "tilted by 20° to 45°"]);
    run(&["."]).code(1).says(&["holds 2 recordings"]);
}

#[test]
fn exports_for_other_programs() {
    let scratch = scene();
    let run = |args: &[&str]| {
        let mut all = vec!["calibrate", "rec", "--model", "brown", "--export"];
        all.extend(args);
        truedepth_in(scratch.path(), all)
    };
    let files = [
        ("a.yml", None, "%YAML:1.0\n"),
        ("a.cameramodel", None, "{\n    'lensmodel':  'LENSMODEL_OPENCV5'"),
        ("cameras.txt", None, "# Camera list"),
        ("a.json", None, "{\n  \"schema\": \"truedepth.calibrate/1\""),
        ("camchain.yaml", Some("kalibr"), "# The lens written differs by"),
        ("ros.yaml", Some("ros"), "image_width: 640\n"),
        ("o3d.json", Some("open3d"), "{\n  \"width\": 640,"),
    ];
    for (file, format, begins) in files {
        let mut args = vec![file];
        args.extend(format.iter().flat_map(|f| ["--format", *f]));
        let run = run(&args).code(0).says(&["calibration: ", file]);
        let text = fs::read_to_string(scratch.join(file)).expect("was written");
        assert!(text.starts_with(begins), "{file}: {text}");
        let lossy = matches!(format, Some("kalibr" | "open3d"));
        assert_eq!(run.stderr.contains("does not hold this lens"), lossy, "{file}: {run:?}");
    }
    // Never over somebody's file, unless that was asked for.
    fs::write(scratch.join("a.yml"), "mine").expect("can be written");
    run(&["a.yml"]).code(1).says(&["a.yml is there already", "--force"]);
    assert_eq!(fs::read_to_string(scratch.join("a.yml")).expect("is there"), "mine");
    run(&["a.yml", "--force"]).code(0);
    run(&["a.xyz"]).code(1).says(&["no format ends like that", "--format"]);
}
