//! Audits: what comes out where, of one recording and of several.

use std::{fs, path::Path};

use serde_json::Value;

use crate::{
    Run,
    scratch::{Scratch, files_of, names, zip},
    truedepth, truedepth_in,
};

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

fn read(path: impl AsRef<Path>) -> String {
    fs::read_to_string(path.as_ref()).unwrap_or_else(|e| panic!("{}: {e}", path.as_ref().display()))
}

#[test]
fn the_report_goes_where_the_person_is() {
    let scratch = Scratch::new();
    scratch.blank_recording("rec");
    let run = truedepth_in(scratch.path(), ["audit", "rec"]);
    assert!(matches!(run.code, Some(0 | 3)), "{run:#?}");
    assert_eq!(names(scratch.path()), ["rec", "rec-report"]);
    assert_eq!(names(&scratch.join("rec-report")), ["report.html", "report.json"]);
    assert!(run.stdout.contains("CANNOT TELL"), "{run:#?}");
    assert!(run.stderr.contains("rec-report"), "{run:#?}");
    assert!(!run.stdout.contains('\u{1b}'), "no colour where no terminal is");
    assert_eq!(json(&read(scratch.join("rec-report/report.json")))["schema"], "truedepth.audit/1");

    // Again, over our own report.
    let again = truedepth_in(scratch.path(), ["audit", "rec", "-q", "--color", "always"]);
    assert_eq!(again.code, run.code);
    assert_eq!(again.stderr, "");
    assert!(again.stdout.contains('\u{1b}'), "{again:#?}");
}

#[test]
fn json_is_all_there_is_on_stdout() {
    let scratch = Scratch::new();
    scratch.blank_recording("rec");
    let run = truedepth_in(scratch.path(), ["audit", "--json", "rec"]);
    assert_eq!(json(&run.stdout)["recording"], "rec");
    assert_eq!(names(scratch.path()), ["rec"], "no report unless -o asks for one");
    truedepth_in(scratch.path(), ["audit", "--json", "rec", "-o", "deep/er"]);
    assert_eq!(read(scratch.join("deep/er/report.json")), run.stdout);
}

#[test]
fn views_that_cannot_disagree_are_refused() {
    let scratch = Scratch::new();
    scratch.blank_recording("rec");
    let run = truedepth_in(scratch.path(), ["audit", "rec", "--views", "2"]);
    run.code(2).says(&["--views", "at least 3 views"]);
    let run = truedepth_in(scratch.path(), ["audit", "rec", "--views", "9", "--json"]);
    assert!(matches!(run.code, Some(0 | 3)), "{run:#?}");
}

#[test]
fn somebody_elses_folder_is_refused_before_the_work() {
    let scratch = Scratch::new();
    scratch.blank_recording("rec");
    let run = truedepth_in(scratch.path(), ["audit", "rec", "-o", "rec"]);
    run.code(1).says(&["error: rec ", "hint: ", "-o"]);
    scratch.write("notes", "mine");
    truedepth_in(scratch.path(), ["audit", "rec", "-o", "notes"]).code(1).says(&["notes"]);
    assert_eq!(read(scratch.join("notes")), "mine");
}

#[test]
fn several_recordings_are_audited_in_order_and_the_worst_counts() {
    let scratch = Scratch::new();
    fs::create_dir(scratch.join("all")).expect("a folder");
    for name in ["all/b", "all/a", "all/broken"] {
        scratch.blank_recording(name);
    }
    fs::write(scratch.join("all/broken/DepthMetadata.json"), "[").expect("it can be written");
    scratch.blank_recording("a");
    let run = truedepth_in(scratch.path(), ["audit", "all", "a", "-o", "out"]).code(1);
    assert!(run.stderr.contains("broken"), "{run:#?}");
    assert_eq!(names(&scratch.join("out")), ["a-report", "a-report-2", "b-report"]);

    let run = truedepth_in(scratch.path(), ["audit", "all/b", "a", "--json"]);
    assert!(matches!(run.code, Some(0 | 3)), "{run:#?}");
    let documents: Vec<Value> =
        serde_json::Deserializer::from_str(&run.stdout).into_iter().map(Result::unwrap).collect();
    let names: Vec<_> = documents.iter().map(|d| d["recording"].as_str()).collect();
    assert_eq!(names, [Some("b"), Some("a")]);
}

#[test]
fn a_zip_is_as_good_as_a_folder() {
    let scratch = Scratch::new();
    let recording = scratch.blank_recording("rec");
    let files = files_of(&recording, "");
    let files: Vec<_> = files.iter().map(|(n, b)| (n.as_str(), b.as_slice())).collect();
    fs::create_dir(scratch.join("zipped")).expect("a folder");
    scratch.write("zipped/rec.zip", zip(&files));
    let of = |path: &str| truedepth_in(scratch.path(), ["audit", "--json", path]);
    let (folder, zip) = (of("rec"), of("zipped/rec.zip"));
    assert_eq!(folder.code, zip.code);
    assert_eq!(folder.stdout, zip.stdout);
}

/// The whole way: simulate, audit with two numbers of threads, calibrate, audit again with the calibration.
#[test]
fn a_simulated_fault_is_found_whatever_the_number_of_threads() {
    let scratch = Scratch::new();
    truedepth_in(
        scratch.path(),
        [
            "simulate",
            "-o",
            "rec",
            "--device",
            "ipad-12.9-5gen",
            "--fault",
            "focal=6.6%",
            "--frames",
            "20",
        ],
    )
    .code(0);
    let audit = |threads: &str, out: &str| -> Run {
        truedepth_in(scratch.path(), ["audit", "rec", "--json", "--threads", threads, "-o", out])
    };
    let (one, three) = (audit("1", "one").code(3), audit("3", "three").code(3));
    assert!(one.stdout == three.stdout, "same input, same bytes");
    // The page names its own folder in the commands that it shows.
    let page =
        read(scratch.join("three/report.html")).replace("three/report.json", "one/report.json");
    assert!(read(scratch.join("one/report.html")) == page);

    let report = json(&one.stdout);
    let truth = json(&read(scratch.join("rec/truth.json")));
    let focal = report["calibration"]["focal_px"]["value"].as_f64().expect("a focal length");
    let sigma = report["calibration"]["focal_px"]["sigma"].as_f64().expect("its sigma");
    let true_focal = truth["camera"]["focal_px"].as_f64().expect("a true focal length");
    assert!((focal - true_focal).abs() < 4.0 * sigma, "{focal} ± {sigma}, truly {true_focal}");
    let td201 =
        report["findings"].as_array().expect("findings").iter().find(|f| f["code"] == "TD201");
    assert_eq!(td201.expect("TD201")["verdict"], "fault");

    let run = truedepth_in(scratch.path(), ["calibrate", "rec", "--json"]).code(0);
    assert_eq!(json(&run.stdout)["focal_px"], report["calibration"]["focal_px"]);
    scratch.write("camera.json", &run.stdout);
    let given =
        truedepth_in(scratch.path(), ["audit", "rec", "--json", "--calibration", "camera.json"]);
    let given = json(&given.stdout);
    assert!(given["calibration"].is_null(), "nothing is calibrated where a camera is given");
    // What the calibration knows of its errors is known to the audit.
    let sigma_of = |report: &Value, code: &str| {
        let findings = report["findings"].as_array().expect("findings");
        let finding = findings.iter().find(|f| f["code"] == code).expect("is checked");
        finding["sigma"].as_f64().expect("a sigma")
    };
    for code in ["TD201", "TD301", "TD401"] {
        let ratio = sigma_of(&given, code) / sigma_of(&report, code);
        assert!((0.5..2.0).contains(&ratio), "{code}: {ratio}");
    }
    let other = run.stdout.replace("\"factory_focal_px\": ", "\"factory_focal_px\": 1");
    scratch.write("other.json", &other);
    truedepth_in(scratch.path(), ["audit", "rec", "--json", "--calibration", "other.json"])
        .code(1)
        .says(&["of another camera"]);
    let error = |report: &Value| {
        1e3 * report["depth"]["own_median_error_m"]["value"].as_f64().expect("depth")
    };
    assert!((error(&given) - error(&report)).abs() < 0.1, "{} {}", error(&given), error(&report));

    // A layout that the images contradict.
    let board = "10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL:new";
    let run = truedepth_in(scratch.path(), ["audit", "rec", "--json", "-q", "--board", board])
        .says(&["taken as seen"]);
    assert_eq!(json(&run.stdout), report);

    // Corners are where they truly are.
    let run = truedepth_in(scratch.path(), ["detect", "rec", "--json", "--timings"]).code(0);
    let detected = json(&run.stdout);
    let (mut n_seen, mut n_true) = (0, 0);
    for (image, frame) in std::iter::zip(
        detected["images"].as_array().expect("images"),
        truth["frames"].as_array().expect("frames"),
    ) {
        assert!(image["detect_ms"].as_f64().expect("timings") > 0.0);
        let corners = frame["corners"].as_array().expect("corners");
        n_true += corners.len();
        for seen in image["corners"].as_array().expect("corners") {
            let place = corners.iter().find(|c| c["id"] == seen["id"]);
            let off = |key: &str| {
                seen[key].as_f64().expect("x")
                    - place.expect("no invented corner")[key].as_f64().expect("x")
            };
            assert!(off("x_px").hypot(off("y_px")) < 1.5, "{seen} in {}", image["path"]);
            n_seen += 1;
        }
    }
    assert!(n_seen * 10 > n_true * 8, "{n_seen} of {n_true} corners seen");
}

#[test]
fn the_demo_finds_what_it_put_in() {
    let scratch = Scratch::new();
    let run =
        truedepth_in(scratch.path(), ["demo"]).code(3).says(&["file:///", "truedepth simulate"]);
    assert!(run.stdout.contains("truth"), "{run:#?}");
    let report = json(&read(scratch.join("truedepth-demo/report.json")));
    for code in ["TD201", "TD301"] {
        let finding =
            report["findings"].as_array().expect("findings").iter().find(|f| f["code"] == code);
        assert_eq!(finding.expect(code)["verdict"], "fault", "{code}");
    }
    assert!(read(scratch.join("truedepth-demo/report.html")).starts_with("<!DOCTYPE html>"));
}

#[test]
fn images_need_a_board_to_look_for() {
    let scratch = Scratch::new();
    let recording = scratch.blank_recording("rec");
    let image = recording.join("rgb_1000.png");
    let detect = |more: &[&str]| {
        let mut args = vec!["detect".as_ref(), image.as_os_str()];
        args.extend(more.iter().map(std::ffi::OsStr::new));
        truedepth(args)
    };
    detect(&[]).code(1).says(&["rgb_1000.png", "hint: ", "--board"]);
    let run = detect(&["--board", "10x8:20mm:10mm:ARUCO_ORIGINAL"]).code(0);
    assert!(run.stdout.contains("no board"), "{run:#?}");
    let run = detect(&["--board", "10x8:20mm:10mm:ARUCO_ORIGINAL", "--json"]).code(0);
    let found = json(&run.stdout);
    assert_eq!(found["schema"], "truedepth.detect/1");
    let image = &found["images"][0];
    assert_eq!((&image["size_px"][0], &image["identity"]), (&Value::from(64), &Value::Null));
    assert!(image.get("detect_ms").is_none(), "times are said only where asked for");
}

#[test]
fn explain_says_every_code() {
    let list = truedepth(["explain"]).code(0).stdout;
    assert!(list.lines().count() > 5, "{list}");
    for line in list.lines() {
        let code = line.split_whitespace().next().expect("a code");
        let text = truedepth(["explain", code]).code(0).stdout;
        assert!(text.contains("## What to do"), "{text}");
        assert!(text.len() > 400, "{code} is hardly explained: {text}");
    }
    truedepth(["explain", "TD999"]).code(1).says(&["TD999", "TD201"]);
}

/// What the summary says to type next, word for word; no name here has a blank in it.
fn commands_of(summary: &str) -> Vec<Vec<&str>> {
    summary
        .lines()
        .filter_map(|line| line.strip_prefix("  truedepth "))
        .map(|command| command.split(' ').collect())
        .collect()
}

#[test]
fn what_to_type_next_is_typed_and_helps() {
    let scratch = Scratch::new();
    let simulate = "simulate --device ipad-12.9-5gen --fault focal=6.6% --fault depth-scale=1.5% --frames 14 -o ipad";
    truedepth_in(scratch.path(), simulate.split(' ')).code(0);
    let run = truedepth_in(scratch.path(), ["audit", "ipad"]).code(3);
    let commands = commands_of(&run.stdout);
    assert_eq!(
        commands[0].join(" "),
        "correct ipad -o ipad-corrected --with ipad-report/report.json"
    );
    truedepth_in(scratch.path(), commands[0].iter().copied()).code(0);
    let checked = truedepth_in(scratch.path(), commands[1].iter().copied()).code(0);
    assert!(checked.stdout.contains("This recording shows no fault."), "{checked:#?}");
    assert_eq!(commands_of(&checked.stdout), [[""; 0]; 0], "nothing is left to type");
    truedepth_in(scratch.path(), commands[2].iter().copied()).code(0);
    let page = read(scratch.join("ipad-report/report.html"));
    for command in &commands[..2] {
        let command = format!("truedepth {}", command.join(" "));
        assert!(
            page.contains(&format!("data-copy=\"{command}\"")),
            "{command}: the page says the same"
        );
    }
}

#[test]
fn several_recordings_stand_beside_each_other_at_the_end() {
    let scratch = Scratch::new();
    for name in ["one", "two"] {
        scratch.blank_recording(name);
    }
    let run = truedepth_in(scratch.path(), ["audit", "one", "two"]);
    let (_, end) = run.stdout.split_once("\n2 recordings\n").expect("an overview");
    assert!(end.contains("  one\n") || end.contains("  one "), "{end}");
    assert!(end.contains("cannot tell"), "{end}");
    assert!(!truedepth_in(scratch.path(), ["audit", "one"]).stdout.contains("1 recording"));
}

#[cfg(not(any(target_os = "macos", windows)))]
#[test]
fn a_report_that_nothing_opens_is_a_report_all_the_same() {
    use std::{os::unix::fs::PermissionsExt, process::Command};
    let scratch = Scratch::new();
    scratch.blank_recording("rec");
    let audit = |programs: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_truedepth"));
        command.args(["audit", "rec", "--open"]).current_dir(scratch.path()).env("PATH", programs);
        Run::of(&mut command)
    };
    let run = audit("nowhere");
    assert!(matches!(run.code, Some(0 | 3)), "the audit has run: {run:#?}");
    run.says(&[
        "error: no program opens rec-report/report.html",
        "xdg-open",
        "hint: open file:///",
    ]);

    // One that fails is passed over; one that works gets the page.
    fs::create_dir(scratch.join("bin")).expect("a folder");
    for (name, script) in [
        ("xdg-open", "#!/bin/sh\nexit 3\n".to_owned()),
        ("gio", format!("#!/bin/sh\necho \"$@\" > {}\n", scratch.join("shown").display())),
    ] {
        let path = scratch.write(&format!("bin/{name}"), script);
        fs::set_permissions(path, fs::Permissions::from_mode(0o755)).expect("it is ours");
    }
    let run = audit(&scratch.join("bin").display().to_string());
    assert!(!run.stderr.contains("error"), "{run:#?}");
    assert_eq!(read(scratch.join("shown")), "open rec-report/report.html\n");
}
