//! `truedepth reproduce`: with nothing, with a little, and never over anything.

use std::fs;

use crate::{
    scratch::{Scratch, files_of, names, zip},
    truedepth,
};

#[test]
fn without_data_the_printed_numbers_are_checked() {
    let scratch = Scratch::new();
    fs::create_dir(scratch.join("empty")).unwrap();
    let (empty, out) = (scratch.join("empty"), scratch.join("out"));
    let run = truedepth([
        "reproduce".as_ref(),
        empty.as_os_str(),
        "-o".as_ref(),
        out.as_os_str(),
        "--json".as_ref(),
    ])
    .code(0)
    .says(&["no recordings in"]);
    let value: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(value["schema"], "truedepth.reproduce/1");
    let equations = value["sections"][0]["checks"].as_array().unwrap();
    assert!(equations.iter().all(|check| check["status"] == "agrees"), "{equations:?}");
    assert_eq!(value["missing"].as_array().map(Vec::len), Some(8));
    assert_eq!(names(&out), ["report.html", "report.json"]);
    assert_eq!(fs::read_to_string(out.join("report.json")).unwrap(), run.stdout);
    // A report of ours is replaced, anything else is not.
    let again = || ["reproduce".as_ref(), empty.as_os_str(), "-o".as_ref(), out.as_os_str()];
    let words = truedepth(again()).code(0).stdout;
    assert!(
        words.contains("525.97") && words.contains("42.0 %") && words.contains("Missing"),
        "{words}"
    );
    fs::write(out.join("report.json"), "mine").unwrap();
    truedepth(again()).code(1).says(&["not empty"]);
    truedepth(["reproduce", "/nowhere/at/all"]).code(1).says(&["/nowhere/at/all"]);
    truedepth(["reproduce"]).code(2).says(&["DIR"]);
}

/// A recording in a zip some folders deep, in which no board is seen, is used for what it has.
#[test]
fn zips_are_looked_into() {
    let scratch = Scratch::new();
    let recording = scratch.blank_recording("iPadPro12_5gen_iOS15");
    let files = files_of(&recording, "DepthEvalDataset/iPadPro12_5gen_iOS15/");
    let files: Vec<(&str, &[u8])> = files.iter().map(|(n, b)| (n.as_str(), b.as_slice())).collect();
    fs::create_dir_all(scratch.join("data/deep")).unwrap();
    scratch.write("data/deep/eval.zip", zip(&files));
    let data = scratch.join("data");
    let run = truedepth(["reproduce".as_ref(), data.as_os_str(), "--json".as_ref()]).code(0);
    let value: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    let found = &value["data"][0];
    assert_eq!((&found["set"], &found["device"]), (&"depth_eval".into(), &"ipad-12.9-5gen".into()));
    assert_eq!(names(scratch.path()), ["data", "iPadPro12_5gen_iOS15"], "no report unless asked");
}
