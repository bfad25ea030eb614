//! Bad input: every error names the file, the place and the remedy.

use std::sync::Arc;

use super::{
    assert_message, color, good, open, read_all, replaced, text,
    zips::{good_zip, read_zip},
};
use crate::{
    files::{Limits, Memory},
    image::{self, DepthMap, Gray},
    recording::FrameImage,
};

#[test]
fn bad_metadata_is_an_error_with_place_and_remedy() {
    for (from, to, expected) in [
        (
            "\"(28.256, 0.0, 16.03)\"",
            "\"(nan, 0.0, 16.03)\"",
            &["rec/DepthMetadata.json, record 1, line", "IntrinsicMatrix.0", "(nan,"][..],
        ),
        (
            "\"(28.256, 0.0, 16.03)\"",
            "28.256",
            &["record 1", "IntrinsicMatrix.0", "3 finite numbers"],
        ),
        (
            "\"(28.256, 0.0, 16.03)\"",
            "\"(0.0, 0.0, 16.03)\"",
            &["record 1 (timestamp 53692)", "IntrinsicMatrix.0 is (0, 0, 16.03)", "focal length"],
        ),
        (
            "\"(28.256, 0.0, 16.03)\"",
            "\"(-28.256, 0.0, 16.03)\"",
            &["IntrinsicMatrix.0", "focal length"],
        ),
        (
            "\"(28.256, 0.0, 16.03)\"",
            "\"(28.256, 0.0, 1e300)\"",
            &["IntrinsicMatrix.0", "principal point"],
        ),
        ("\"(28.256, 0.0, 16.03)\"", "\"(28.256, 0.5, 16.03)\"", &["IntrinsicMatrix.0", "skew"]),
        (
            "\"(0.0, 28.25601, 12.06)\"",
            "\"(0.0, 1e-300, 12.06)\"",
            &["IntrinsicMatrix.1", "focal length"],
        ),
        ("\"IntrinsicMatrix.1\"", "\"Other\"", &["record 1", "missing field `IntrinsicMatrix.1`"]),
        (
            "\"Timestamp\" : 53692",
            "\"Timestamp\" : \"53692\"",
            &["record 1", "Timestamp", "string \"53692\""],
        ),
        ("\"Timestamp\" : 53692", "\"Timestamp\" : NaN", &["record 1", "`\"Timestamp\" : NaN,`"]),
        ("\"Timestamp\" : 53692", "\"Timestamp\" : 1e99", &["record 1", "Timestamp"]),
        ("\"Width\" : 32", "\"Width\" : 0", &["record 1", "Width is 0"]),
        ("\"Width\" : 32", "\"Width\" : -1", &["record 1", "`-1`"]),
        ("\"Height\" : 24", "\"Height\" : 4000000000", &["record 1", "Height is 4000000000"]),
        ("(2016.0, 1512.0)", "(0.0, 1512.0)", &["IntrinsicMatrixReferenceDimensions is (0, 1512)"]),
        ("(2016.0, 1512.0)", "(inf, 1512.0)", &["record 1", "2 finite numbers"]),
        (
            "\"IntrinsicMatrixReferenceDimensions\"",
            "\"Other\"",
            &["LensDistortionCenter is missing or without a scale"],
        ),
        (
            "\"LensDistortionCenter\"",
            "\"Other\"",
            &["LensDistortionCenter is missing or without a scale"],
        ),
        (
            "\"LensDistortionCenter\" : \"(",
            "\"LensDistortionCenter\" : \"(9",
            &["LensDistortionCenter", "in or near the image of 2016x1512"],
        ),
        ("\"PixelSize\" : 0.0", "\"PixelSize\" : -0.0", &["PixelSize is -0.001"]),
        (
            "\"LensDistortionLookupTable\" : [\n",
            "\"LensDistortionLookupTable\" : [\n 1e300,\n",
            &["LensDistortionLookupTable", "between -1 and 1"],
        ),
        (
            "\"LensDistortionLookupTable\" : [\n",
            "\"LensDistortionLookupTable\" : [\n 0.9, -0.9,\n",
            &["LensDistortionLookupTable is 44 numbers"],
        ),
        (
            "\"LensDistortionLookupTable\" : [\n",
            "\"LensDistortionLookupTable\" : [\n null,\n",
            &["record 1", "invalid type: null"],
        ),
        (
            "\"LensDistortionLookupTable\" : [\n",
            "\"LensDistortionLookupTable\" : [],\"Other\" : [\n",
            &["LensDistortionLookupTable is 0 numbers"],
        ),
        (
            "\"ExtrinsicMatrix.1\" : \"(",
            "\"ExtrinsicMatrix.1\" : \"(7, ",
            &["ExtrinsicMatrix.1", "4 finite numbers"],
        ),
    ] {
        let error = open(replaced("DepthMetadata.json", from, to)).unwrap_err();
        assert_message(&error, expected);
        assert_message(
            &error,
            &["rec/DepthMetadata.json", "copy the file from the device again, or correct that"],
        );
    }
    for (from, to, expected) in [
        ("\"Timestamp\" : 53692", "\"Timestamp\" : true", &["record 1", "Timestamp"][..]),
        (
            "\"VideoFieldOfView\" : ",
            "\"VideoFieldOfView\" : 10000",
            &["VideoFieldOfView is", "less than 180"],
        ),
        (
            "\"GeometricDistortionCorrectionEnabled\" : true",
            "\"GeometricDistortionCorrectionEnabled\" : 1",
            &["GeometricDistortion", "expected a boolean"],
        ),
        ("\"Width\" : 32", "\"Width\" : 0", &["Width is 0"]),
    ] {
        let error = open(replaced("CameraMetadata.json", from, to)).unwrap_err();
        assert_message(&error, expected);
        assert_message(&error, &["rec/CameraMetadata.json", "copy the file from the device again"]);
    }
}

#[test]
fn cut_metadata_names_the_record() {
    let json = text(&good(), "DepthMetadata.json");
    for (n, record) in [(json.len() / 2, 2), (json.len() * 5 / 6, 3), (1, 1), (0, 1)] {
        let mut memory = good();
        memory.insert("DepthMetadata.json", &json.as_bytes()[..n]);
        let expected =
            format!("rec/DepthMetadata.json ends in the middle of record {record} (byte {n})");
        let keep = format!("keep its {} whole records", record - 1);
        assert_message(
            &open(memory).unwrap_err(),
            &[&expected, &keep, "copy it from the device again"],
        );
    }
}

#[test]
fn images_that_do_not_fit() {
    let with = |name: &str, bytes: Vec<u8>| {
        let mut memory = good();
        memory.insert(name, bytes);
        read_all(Arc::new(memory), &Limits::default()).unwrap_err()
    };
    let half = good().get("rgb_54692.png").unwrap()[..200].to_vec();
    assert_message(
        &with("rgb_54692.png", half),
        &["rec/rgb_54692.png", "truncated", "copy the file again"],
    );
    assert_message(&with("depth_54692.png", Vec::new()), &["rec/depth_54692.png", "truncated"]);
    assert_message(&with("rgb_54692.png", b"GIF89a".to_vec()), &["rec/rgb_54692.png", "PNG"]);
    let small = DepthMap::new(16, 12, vec![1.0; 16 * 12]).to_png(1e-4);
    let said =
        ["rec/depth_54692.png is 16x12 pixels, but DepthMetadata.json says 32x24 for frame 54692"];
    assert_message(&with("depth_54692.png", small), &said);
    let small = Gray::new(16, 12, vec![1; 16 * 12]).to_png();
    let said =
        ["rec/rgb_54692.png is 16x12 pixels, but CameraMetadata.json says 32x24 for frame 54692"];
    assert_message(&with("rgb_54692.png", small), &said);
    assert_message(
        &with("depth_54692.png", color(0).to_png()),
        &["rec/depth_54692.png", "16-bit grey"],
    );
    // Colour and depth may differ in size: each has its own parameters.
    let mut memory = replaced("CameraMetadata.json", "\"Width\" : 32", "\"Width\" : 16");
    let json = text(&memory, "CameraMetadata.json");
    memory.insert("CameraMetadata.json", json.replacen("\"Height\" : 24", "\"Height\" : 12", 1));
    memory.insert("rgb_53692.png", Gray::new(16, 12, vec![1; 16 * 12]).to_png());
    let recording = open(memory).unwrap();
    assert_eq!(recording.gray(0).unwrap().width(), 16);
    let frame = &recording.frames[0];
    let of = |image: &Option<FrameImage>| image.as_ref().unwrap().factory.clone().unwrap();
    let (color, depth) = (of(&frame.color), of(&frame.depth));
    assert_eq!((color.size(), depth.size()), ([16, 12], [32, 24]));
    assert_eq!(color.intrinsics.fx, depth.intrinsics.fx / 2.0);
    assert_eq!(
        color.tables.as_ref().unwrap().inverse.max_radius_px,
        depth.tables.as_ref().unwrap().inverse.max_radius_px / 2.0
    );
    let limits = Limits { image: image::Limits { pixels: 700 }, ..Limits::default() };
    let error = read_all(Arc::new(good()), &limits).unwrap_err();
    assert_message(&error, &["rec/rgb_53692.png", "32x24 pixels are more than the limit of 700"]);
    let limits = Limits { file_bytes: 3000, ..Limits::default() };
    let error = read_all(Arc::new(good()), &limits).unwrap_err();
    assert_message(&error, &["rec/DepthMetadata.json: longer than the limit of 3000 bytes"]);
}

#[test]
fn not_a_recording() {
    let looked_for =
        "looked for rgb_<milliseconds>.png, depth_<milliseconds>.png and DepthMetadata.json";
    let mut memory = Memory::new("rec");
    let error = open(memory.clone()).unwrap_err();
    assert_message(
        &error,
        &["rec is not a recording", looked_for, "found nothing at all", "a .zip of it"],
    );
    memory.insert("holiday.gif", *b"x");
    memory.insert("more/holiday.gif", *b"x");
    memory.insert("notes", *b"x");
    assert_message(&open(memory.clone()).unwrap_err(), &["found 3 files (2 gif, 1 no extension)"]);
    // Photos alone are a format of their own.
    memory.insert("b.JPG", *b"x");
    memory.insert("a.png", *b"x");
    let photos = open(memory).unwrap();
    assert_eq!(photos.format, "images");
    assert_eq!(photos.frames.iter().map(|f| f.id.as_str()).collect::<Vec<_>>(), ["a.png", "b.JPG"]);
    let mut memory = Memory::new("rec");
    memory.insert("DepthMetadata.json", *b"[]");
    assert_message(
        &open(memory).unwrap_err(),
        &["rec holds metadata but no image", "copy the whole folder"],
    );
}

/// Flips, cuts and splices a small recording a few thousand times: whatever comes out, it comes back, and soon.
#[test]
fn damaged_recordings_never_panic() {
    let mut state = 1_u64;
    let mut random = move |below: usize| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 33) as usize) % below.max(1)
    };
    let mut mutate = |bytes: &mut Vec<u8>| {
        for _ in 0..=random(3) {
            let at = random(bytes.len());
            match random(5) {
                0 => bytes.truncate(at),
                1 if !bytes.is_empty() => bytes[at] ^= 1 << random(8),
                2 if !bytes.is_empty() => bytes[at] = b"0-9{}[]\",:eEnN\\\xff\x00"[random(17)],
                3 => {
                    let end = (at + random(40)).min(bytes.len());
                    bytes.drain(at..end);
                }
                _ => {
                    let end = (at + random(40)).min(bytes.len());
                    let piece = bytes[at..end].to_vec();
                    let to = random(bytes.len());
                    bytes.splice(to..to, piece);
                }
            }
        }
    };
    let (good, zipped) = (good(), good_zip());
    let names: Vec<String> = good.files().keys().cloned().collect();
    let mut n_errors = 0;
    for i in 0..3000 {
        let limits = Limits { total_bytes: 1 << 24, ..Limits::default() };
        let result = if i % 3 == 0 {
            let mut bytes = zipped.clone();
            mutate(&mut bytes);
            read_zip(bytes, &limits)
        } else {
            let mut memory = good.clone();
            let name = &names[i % names.len()];
            let mut bytes = memory.get(name).unwrap().to_vec();
            mutate(&mut bytes);
            memory.insert(name.clone(), bytes);
            read_all(Arc::new(memory), &limits)
        };
        if let Err(error) = result {
            n_errors += 1;
            assert!(error.to_string().len() > 20, "{error}");
        }
    }
    assert!((1500..3000).contains(&n_errors), "{n_errors} of 3000");
}
