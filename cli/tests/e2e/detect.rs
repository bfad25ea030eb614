//! Detection in images: what is read, what is refused, what is drawn.

use std::fs;

use truedepth::image::{Gray, Limits, Rgb};

use crate::{
    scratch::{Scratch, names},
    truedepth_in,
};

const BOARD: [&str; 2] = ["--board", "10x8:20mm:10mm:ARUCO_ORIGINAL"];

#[test]
fn the_content_says_what_a_file_is() {
    let scratch = Scratch::new();
    let png = Gray::new(64, 48, vec![90; 64 * 48]).to_png();
    scratch.write("png-inside.jpg", &png);
    scratch.write("no-extension", &png);
    for name in ["png-inside.jpg", "no-extension"] {
        let run = truedepth_in(scratch.path(), ["detect", name, BOARD[0], BOARD[1]]).code(0);
        assert!(run.stdout.contains("no board"), "{run:#?}");
    }
    scratch.write("photo.heic", b"\0\0\0\x28ftypheic\0\0\0\0mif1");
    truedepth_in(scratch.path(), ["detect", "photo.heic", BOARD[0], BOARD[1]]).code(1).says(&[
        "photo.heic",
        "HEIC",
        "convert it to PNG",
    ]);
    scratch.write("cut.jpg", b"\xff\xd8\xff\xe0\0\x10JFIF");
    truedepth_in(scratch.path(), ["detect", "cut.jpg", BOARD[0], BOARD[1]]).code(1).says(&[
        "cut.jpg",
        "truncated JPEG",
        "copy the file again",
    ]);
}

#[test]
fn overlays_are_drawn_and_never_over_somebody_elses_files() {
    let scratch = Scratch::new();
    scratch.blank_recording("rec");
    let png = Gray::new(64, 48, vec![90; 64 * 48]).to_png();
    for folder in ["a", "b"] {
        fs::create_dir(scratch.join(folder)).expect("a folder");
        scratch.write(&format!("{folder}/photo.png"), &png);
    }
    let detect = |paths: &[&str], more: &[&str]| {
        let all = ["detect", BOARD[0], BOARD[1], "--overlay", "seen"];
        truedepth_in(scratch.path(), all.iter().chain(paths).chain(more).copied())
    };
    detect(&["rec", "a", "b/photo.png"], &[]).code(0).says(&["overlays: seen"]);
    let expected = [
        "photo-2.overlay.png",
        "photo.overlay.png",
        "rec-rgb_1000.overlay.png",
        "rec-rgb_1500.overlay.png",
        "rec-rgb_2000.overlay.png",
    ];
    assert_eq!(names(&scratch.join("seen")), expected);
    let drawn = fs::read(scratch.join("seen/photo.overlay.png")).expect("an overlay");
    let drawn = Rgb::decode(&drawn, &Limits::default()).expect("a PNG");
    assert_eq!((drawn.width(), drawn.height()), (256, 192), "small images are enlarged");

    // Not twice without a word, and with one only over our own.
    detect(&["a"], &[]).code(1).says(&["seen", "not empty", "--force"]);
    scratch.write("seen/photo.overlay.png", "older");
    scratch.write("seen/notes", "mine");
    detect(&["a"], &["--force"]).code(0);
    assert_ne!(fs::read(scratch.join("seen/photo.overlay.png")).expect("still there"), b"older");
    assert_eq!(fs::read(scratch.join("seen/notes")).expect("still there"), b"mine");

    // Into the searched folder itself: the photo stays, and overlays are not searched the next time.
    for _ in 0..2 {
        let args = ["detect", "a", BOARD[0], BOARD[1], "--overlay", "a", "--force"];
        let run = truedepth_in(scratch.path(), args).code(0);
        assert!(run.stdout.contains("0 of 1 images"), "{run:#?}");
        assert_eq!(names(&scratch.join("a")), ["photo.overlay.png", "photo.png"]);
        assert_eq!(fs::read(scratch.join("a/photo.png")).expect("still there"), png);
    }
    truedepth_in(scratch.path(), ["detect", "a", "--force"]).code(2).says(&["--overlay"]);
}
