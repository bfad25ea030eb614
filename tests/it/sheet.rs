//! The printed target, searched by the detector.

use std::fs;

use truedepth::{
    board::{CharucoBoard, Dictionary, Layout, Paper, Sheet},
    detect::Detector,
    report::{sheet_image, sheet_pdf, sheet_svg},
};

use crate::data;

/// Prints the board at 100 pixels per inch and lets the detector find it.
#[track_caller]
fn all_corners_are_found(board: &CharucoBoard, layout: Layout) {
    const DPI: u32 = 100;
    let sheet = Sheet::new(board, layout, Paper::A4, None).expect("it fits");
    let image = sheet_image(&sheet, DPI);
    let seen = Detector::new(board).detect(&image);
    let identity = seen.identity.as_ref().unwrap_or_else(|| panic!("{board}: not identified"));
    // With an odd number of rows both layouts are the same.
    if board.squares_y.is_multiple_of(2) {
        assert_eq!(identity.layout, layout, "{board}");
    }
    assert!(!identity.mirrored && !identity.inverted, "{board}: {identity:?}");
    assert_eq!(seen.corners.len(), board.n_corners(), "{board}");
    for corner in &seen.corners {
        let at = board.corner(corner.id);
        let pixel = |mm: f64| mm * f64::from(DPI) / 25.4 - 0.5;
        let (x, y) =
            (pixel(sheet.board_mm[0] + 1e3 * at.x()), pixel(sheet.board_mm[1] + 1e3 * at.y()));
        let off = (corner.pixel.x - x).hypot(corner.pixel.y - y);
        assert!(off < 0.1, "{board}: corner {} is {off:.3} px off", corner.id);
    }
}

#[test]
fn the_detector_finds_what_is_printed() {
    for text in [
        "10x7:24mm:18mm:5X5_100",
        "10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL",
        "8x6:28mm:20mm:4X4_50",
        "6x8:25mm:19mm:6X6_250",
        "8x6:28mm:23mm:7X7_1000",
        "8x6:28mm:19mm:APRILTAG_36h11",
    ] {
        for layout in [Layout::Legacy, Layout::New] {
            all_corners_are_found(&text.parse().expect("a board"), layout);
        }
    }
}

/// The dictionary of OpenCV's tutorials, which is none of the predefined ones.
#[test]
fn a_dictionary_of_ones_own_is_printed_and_found() {
    let Some(path) = data("opencv-aruco-tutorials/config/tutorial_dict.yml") else { return };
    let yaml = fs::read_to_string(path).expect("it reads");
    let dictionary =
        Dictionary::from_opencv_yaml("tutorial_dict.yml", &yaml).expect("OpenCV reads it");
    assert_eq!((dictionary.len(), dictionary.bits()), (35, 6));
    assert_eq!(dictionary.code(34), Some(0b011111_010000_111011_111110_110101_100101));
    let board = CharucoBoard::new((8, 6), 0.028, 0.021, dictionary).expect("a board");
    all_corners_are_found(&board, Layout::New);
    all_corners_are_found(&board, Layout::Legacy);
}

/// Every rectangle of the sheet stands in both vector formats, at its place.
#[test]
fn vector_formats_hold_every_rectangle() {
    let board: CharucoBoard = "10x7:24mm:18mm:5X5_100".parse().expect("a board");
    let sheet = Sheet::new(&board, Layout::New, Paper::Letter, None).expect("it fits");
    let svg = sheet_svg(&sheet);
    let pdf = sheet_pdf(&sheet);
    let pdf = String::from_utf8_lossy(&pdf);
    let n = sheet.shapes.iter().flatten().count();
    assert_eq!(svg.matches("H").count() - svg.matches("Helvetica").count(), 2 * n);
    assert_eq!(pdf.matches(" l h\n").count(), n);
    assert_eq!(pdf.matches("\nf\n").count(), sheet.shapes.len());
    assert!(svg.contains("width=\"279.4mm\" height=\"215.9mm\" viewBox=\"0 0 279.4 215.9\""));
    assert!(pdf.contains("/MediaBox [0 0 792 612]"));
    // The first black square, whose lower left corner in points stands 72/25.4 times as far from the lower left.
    let [x, y] = sheet.board_mm;
    assert_eq!([x, y].map(|v| (v * 1e3).round()), [19_700.0, 13_950.0]);
    assert!(svg.contains("M19.7 13.95H43.7V37.95H19.7Z"), "{svg}");
    assert!(
        pdf.contains("55.84252 572.45669 m 123.87402 572.45669 l 123.87402 504.4252 l"),
        "{pdf}"
    );
    for text in &sheet.texts {
        assert!(svg.contains(&format!(">{}</text>", text.text)), "{text:?}");
        assert!(
            pdf.contains(&format!("({}) Tj", text.text.replace('(', "\\(").replace(')', "\\)"))),
            "{text:?}"
        );
    }
}
