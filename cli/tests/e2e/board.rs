//! `truedepth board`.

use std::fs;

use crate::{scratch::Scratch, truedepth_in};

const MINE: &str = "%YAML:1.0\nnmarkers: 4\nmarkersize: 3\nmarker_0: \"110000001\"\nmarker_1: \"011001010\"\n\
                    marker_2: \"010110111\"\nmarker_3: \"100010110\"\n";

#[test]
fn what_is_printed_can_be_detected() {
    let scratch = Scratch::new();
    let run = |line: &str| truedepth_in(scratch.path(), line.split(' '));
    run("board -o out/board.png --dpi 100").code(0).says(&["100 %", "10x7:24mm:15mm:5X5_100:new"]);
    let toml = fs::read_to_string(scratch.join("out/board.toml")).expect("it was written");
    assert_eq!(
        toml,
        "squares_x = 10\nsquares_y = 7\nsquare = \"24mm\"\nmarker = \"15mm\"\ndictionary = \"5X5_100\"\n\
         layout = \"new\"\n"
    );
    let found = run("detect out/board.png --board out/board.toml").code(0).stdout;
    assert!(found.contains("54 corners; board in 1 of 1 images"), "{found}");

    // The same board may be printed again in another form, another board may not take its place unasked.
    run("board -o out/board.svg").code(0);
    run("board -o out/board.svg --paper letter")
        .code(1)
        .says(&["board.svg is there already", "--force"]);
    run("board -o out/other.pdf --board paper").code(1).says(&["board.toml is there already"]);
    assert!(!scratch.join("out/other.pdf").exists());
    run("board -o out/other.pdf --board paper --force").code(0).says(&["legacy"]);
    assert!(fs::read(scratch.join("out/other.pdf")).expect("as above").starts_with(b"%PDF-1."));
    let toml = fs::read_to_string(scratch.join("out/board.toml")).expect("as above");
    assert!(toml.contains("\"20.875mm\"") && toml.contains("legacy"), "{toml}");
    assert_eq!(
        fs::read_dir(scratch.join("out")).expect("as above").count(),
        4,
        "no temporary file"
    );
}

#[test]
fn a_dictionary_of_ones_own_goes_along() {
    let scratch = Scratch::new();
    let run = |line: &str| truedepth_in(scratch.path(), line.split(' '));
    scratch.write("mine.yml", MINE);
    run("board -o a/board.png --dpi 100 --board 3x3:40mm:30mm:mine.yml:new").code(0);
    let toml = fs::read_to_string(scratch.join("a/board.toml")).expect("it was written");
    assert!(toml.contains("dictionary = \"mine.yml\""), "{toml}");
    fs::remove_file(scratch.join("mine.yml")).expect("it is there");
    // The copy beside board.toml is enough.
    run("board -o a/board.svg --board a/board.toml").code(0);
    run("board -o b/board.svg --board 3x3:40mm:30mm:a/mine.yml").code(0);
    fs::remove_file(scratch.join("a/mine.yml")).expect("it was copied");
    run("board -o c.svg --board a/board.toml").code(1).says(&["mine.yml", "beside"]);
    run("board -o c.svg --board 3x3:40mm:30mm:gone.yml").code(1).says(&["gone.yml"]);
    run("board -o c.svg --board 5x5:30mm:20mm:b/mine.yml")
        .code(1)
        .says(&["mine.yml has 4 markers"]);
    scratch.write("bad.yml", MINE.replace("markersize: 3", "markersize: 9"));
    run("board -o c.svg --board 3x3:40mm:30mm:bad.yml")
        .code(1)
        .says(&["bad.yml, line 3: ", "3 to 8"]);
}

#[test]
fn what_cannot_be_printed() {
    let scratch = Scratch::new();
    let run = |line: &str| truedepth_in(scratch.path(), line.split(' '));
    run("board -o board.jpg").code(2).says(&[".pdf, .svg or .png"]);
    run("board -o board.pdf --board 10x7:30mm:20mm:5X5_100")
        .code(1)
        .says(&["24.28 mm", "A3 landscape"]);
    run("board -o board.pdf --board 10x7:30:20:5X5_100").code(2).says(&["unit"]);
    run("board -o board.pdf --board paper --layout new").code(1).says(&["legacy", "--layout"]);
    run("board -o board.pdf --dpi 600").code(1).says(&["--dpi is for PNG"]);
    assert_eq!(fs::read_dir(scratch.path()).expect("a folder").count(), 0);
}
