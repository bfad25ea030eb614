//! Whole recordings, good and bad, in memory and on disk.

mod bad;
#[cfg(feature = "fs")]
mod disk;
mod zips;

use std::sync::Arc;

use super::{Error, Factory, Problem, Recording, Writer, discover_in};
use crate::{
    board::CharucoBoard,
    camera::{Intrinsics, RadialTable, TablePair},
    files::{Files, Limits, Memory},
    geom::Pixel,
    image::{DepthMap, Rgb},
};

/// Factory metadata with every field set, in the proportions of the 5gen iPad.
fn factory() -> Factory {
    let center = Pixel::new(16.02, 12.05);
    let radius = RadialTable::farthest_corner_px(center, 32, 24);
    let table = |scale: f64| {
        let samples = (0..42).map(|i| scale * (f64::from(i) / 41.0).powi(2) - 1e-3).collect();
        RadialTable::new(center, radius, samples).unwrap()
    };
    Factory {
        intrinsics: Intrinsics {
            fx: 28.256,
            fy: 28.25601,
            cx: 16.03,
            cy: 12.06,
            width: 32,
            height: 24,
        },
        reference_dimensions: Some([2016.0, 1512.0]),
        distortion_center: Some(center),
        tables: Some(TablePair { forward: table(-0.1), inverse: table(0.15) }),
        pixel_size_m: Some(1.0000000474974513e-6),
        extrinsics: Some([[1.0, 0.0, 0.0, 0.001], [0.0, 1.0, 0.0, -0.02], [0.0, 0.0, 1.0, 1e-7]]),
        depth_absolute: Some(true),
        depth_filtered: Some(false),
        geometric_distortion_correction: Some(true),
        device_type: Some("AVCapture\"Device\\Type".into()),
        field_of_view_rad: Some(1.2791),
    }
}

fn color(seed: usize) -> Rgb {
    Rgb::new(
        32,
        24,
        (0..32 * 24).map(|i| [(i * 7 + seed) as u8, (i / 5) as u8, seed as u8]).collect(),
    )
}

fn depth(seed: usize) -> DepthMap {
    let at = |i: usize| {
        if i.is_multiple_of(11) { f32::NAN } else { 0.2 + ((i + seed) % 100) as f32 * 1e-4 }
    };
    DepthMap::new(32, 24, (0..32 * 24).map(at).collect())
}

const TIMES: [i64; 3] = [53692, 54692, 55192];

fn good() -> Memory {
    let mut writer = Writer::new(Memory::new("rec"));
    for (i, t) in TIMES.into_iter().enumerate() {
        writer.frame(t, &color(i), &depth(i), &factory()).unwrap();
    }
    writer.board(&CharucoBoard::paper(0.020875).unwrap()).unwrap();
    writer.finish().unwrap()
}

fn open(memory: Memory) -> Result<Recording, Error> {
    Recording::from_files(Arc::new(memory), &Limits::default())
}

/// Opens a recording and decodes all of it.
fn read_all(source: Arc<dyn Files>, limits: &Limits) -> Result<Recording, Error> {
    let recording = Recording::from_files(source, limits)?;
    for (i, frame) in recording.frames.iter().enumerate() {
        if frame.color.is_some() {
            recording.color(i)?;
            recording.gray(i)?;
        }
        if frame.depth.is_some() {
            recording.depth(i)?;
        }
    }
    Ok(recording)
}

fn text(memory: &Memory, name: &str) -> String {
    String::from_utf8(memory.get(name).unwrap().to_vec()).unwrap()
}

/// The good recording with a text replaced in one of its files, wherever it stands there.
fn replaced(name: &str, from: &str, to: &str) -> Memory {
    let mut memory = good();
    let before = text(&memory, name);
    assert!(before.contains(from), "{name} has no {from}");
    memory.insert(name, before.replacen(from, to, 1));
    memory
}

#[track_caller]
fn assert_message(error: &impl ToString, parts: &[&str]) {
    let message = error.to_string();
    for part in parts {
        assert!(message.contains(part), "no `{part}` in: {message}");
    }
    assert!(!message.contains(['\u{1b}', '\n', '\0']), "{message:?}");
}

#[test]
fn what_is_written_reads_back() {
    let recording = read_all(Arc::new(good()), &Limits::default()).unwrap();
    assert_eq!(recording.name, "rec");
    assert_eq!(recording.problems, []);
    assert!(recording.board == Some(CharucoBoard::paper(0.020875).unwrap()));
    assert_eq!(
        recording.frames.iter().map(|f| f.id.as_str()).collect::<Vec<_>>(),
        ["53692", "54692", "55192"]
    );
    assert_eq!(recording.frames[1].t_ns, 1_000_000_000);
    for i in 0..3 {
        assert_eq!(recording.color(i).unwrap(), color(i));
        assert_eq!(recording.gray(i).unwrap(), color(i).to_gray());
        for (a, b) in recording.depth(i).unwrap().depth_m().iter().zip(depth(i).depth_m()) {
            assert!(a == b || (a.is_nan() && b.is_nan()) || (a - b).abs() < 1e-7, "{a} {b}");
        }
        let (read, written) = (recording.frames[i].factory().unwrap(), factory());
        // Texts, counts and what is not scaled come back to the last bit.
        assert_eq!(read.intrinsics, written.intrinsics);
        assert_eq!(read.reference_dimensions, written.reference_dimensions);
        assert_eq!(read.device_type, written.device_type);
        assert_eq!(read.geometric_distortion_correction, Some(true));
        assert_eq!((read.depth_absolute, read.depth_filtered), (Some(true), Some(false)));
        let (tables, expected) = (read.tables.as_ref().unwrap(), written.tables.unwrap());
        assert_eq!(tables.forward.magnification, expected.forward.magnification);
        assert_eq!(tables.inverse.magnification, expected.inverse.magnification);
        // The rest went through millimetres, degrees or the reference size and back.
        let close =
            |a: f64, b: f64| assert!((a - b).abs() <= 1e-15 * b.abs().max(1e-6) * 4.0, "{a} {b}");
        close(tables.inverse.max_radius_px, expected.inverse.max_radius_px);
        close(tables.inverse.center.x, expected.inverse.center.x);
        close(read.distortion_center.unwrap().y, written.distortion_center.unwrap().y);
        close(read.pixel_size_m.unwrap(), written.pixel_size_m.unwrap());
        close(read.field_of_view_rad.unwrap(), written.field_of_view_rad.unwrap());
        for (a, b) in read
            .extrinsics
            .iter()
            .flatten()
            .flatten()
            .zip(written.extrinsics.iter().flatten().flatten())
        {
            close(*a, *b);
        }
    }
    // Frames of which the metadata say the same share it: it is longer than all else that is kept of a frame.
    let images = recording.frames.iter().flat_map(|f| [&f.color, &f.depth]).flatten();
    let said: Vec<_> = images.map(|image| image.factory.as_ref().unwrap()).collect();
    assert!(said.len() == 6 && said.windows(2).all(|pair| Arc::ptr_eq(pair[0], pair[1])));
    // A second writing changes nothing any more.
    let mut writer = Writer::new(Memory::new("rec"));
    for (i, frame) in recording.frames.iter().enumerate() {
        let factory = frame.factory().unwrap();
        writer
            .frame(TIMES[i], &recording.color(i).unwrap(), &recording.depth(i).unwrap(), factory)
            .unwrap();
    }
    let again = writer.finish().unwrap();
    assert_eq!(again.get("rgb_53692.png"), good().get("rgb_53692.png"));
    assert_eq!(again.get("depth_53692.png"), good().get("depth_53692.png"));
}

/// An app that is killed while it records leaves whole frames and no end of the metadata.
#[test]
fn a_writer_that_is_killed_leaves_whole_frames() {
    let mut writer = Writer::new(Memory::new("rec"));
    for (i, t) in TIMES.into_iter().enumerate() {
        writer.frame(t, &color(i), &depth(i), &factory()).unwrap();
        let so_far = writer.output().clone();
        let recording = read_all(Arc::new(so_far), &Limits::default()).unwrap();
        assert_eq!(recording.frames.len(), i + 1);
        assert!(recording.frames.iter().all(|frame| frame.factory() == Some(&factory())));
        let unfinished = |file| Problem::MetadataUnfinished { file };
        assert_eq!(
            recording.problems,
            ["DepthMetadata.json", "CameraMetadata.json"].map(unfinished),
            "said, and nothing else is odd"
        );
    }
    // Stopped in the middle of a record: that is still an error with its place.
    let mut cut = writer.output().clone();
    let whole = text(&cut, "DepthMetadata.json");
    cut.insert("DepthMetadata.json", &whole.as_bytes()[..whole.len() - 30]);
    assert_message(&open(cut).unwrap_err(), &["ends in the middle of record 3"]);
}

#[test]
fn a_pinhole_alone_round_trips() {
    let mut writer = Writer::new(Memory::new("rec"));
    let factory = Factory::pinhole(factory().intrinsics);
    writer.frame(0, &color(0), &depth(0), &factory).unwrap();
    let recording = open(writer.finish().unwrap()).unwrap();
    assert_eq!(recording.factory(), Some(&factory));
    assert_eq!(recording.problems, []);
    assert!(recording.board.is_none());
}

/// The capture app's own text, as in the paper's recordings.
#[test]
fn spelling_of_the_app() {
    let json = text(&good(), "DepthMetadata.json");
    assert!(json.starts_with("[\n{\n  \"Accuracy\" : 1,\n"), "{json:.60}");
    for line in [
        "  \"IntrinsicMatrix.0\" : \"(28.256, 0.0, 16.03)\",\n",
        "  \"IntrinsicMatrixReferenceDimensions\" : \"(2016.0, 1512.0)\",\n",
        "\n},{\n",
        "  \"Timestamp\" : 53692,\n",
        "\n}\n]\n",
    ] {
        assert!(json.contains(line), "{line}");
    }
}

#[test]
fn pairing_problems_are_listed() {
    let mut memory = good();
    memory.insert("rgb_1.png", color(0).to_png());
    memory.insert("rgb_01.png", color(0).to_png());
    memory.insert("rgb_new.png", color(0).to_png());
    memory.insert("depth_99999.png", memory.get("depth_53692.png").unwrap().to_vec());
    let mut files = Memory::new("rec");
    for (name, bytes) in memory.files().iter().filter(|(name, _)| !name.contains("55192")) {
        files.insert(name.clone(), bytes.clone());
    }
    let recording = read_all(Arc::new(files), &Limits::default()).unwrap();
    let times: Vec<i64> = recording.frames.iter().map(|f| f.id.parse().unwrap()).collect();
    assert_eq!(times, [1, 53692, 54692, 99999]);
    assert!(recording.frames[0].factory().is_none());
    assert_eq!(recording.factory().unwrap().intrinsics, factory().intrinsics);
    let lonely = vec![1, 99999];
    let unmatched = |file| Problem::ImagesWithoutMetadata { file, timestamps: lonely.clone() };
    assert_eq!(
        recording.problems,
        [
            Problem::UnusableNames { names: vec!["rgb_new.png".into()] },
            Problem::DuplicateImages { names: vec!["rgb_1.png".into()] },
            Problem::ColorWithoutDepth { timestamps: vec![1] },
            Problem::DepthWithoutColor { timestamps: vec![99999] },
            Problem::MetadataWithoutImages { timestamps: vec![55192] },
            unmatched("DepthMetadata.json"),
            unmatched("CameraMetadata.json"),
        ]
    );
    for problem in &recording.problems {
        let text = problem.to_string();
        assert!(text.chars().any(|c| c.is_ascii_digit()) && text.len() > 20, "{text}");
    }
    assert_message(&recording.depth(0).unwrap_err(), &["rec has no depth image at frame 0"]);
    assert_message(&recording.gray(3).unwrap_err(), &["no colour image at frame 3"]);
    assert_message(&recording.gray(9).unwrap_err(), &["no colour image at frame 9"]);
}

#[test]
fn metadata_problems_are_listed() {
    // Records in another order, and one twice.
    let json = text(&good(), "DepthMetadata.json");
    let records: Vec<&str> = json.trim_matches(['[', ']', '\n']).split("},{").collect();
    let [a, b, c] = records[..] else { panic!("{} records", records.len()) };
    let (a, c) = (a.trim_start_matches('{'), c.trim_end_matches('}'));
    let mut memory = good();
    let varied = c.replace("(28.256,", "(28.257,");
    memory.insert("DepthMetadata.json", format!("[{{{b}}},{{{a}}},{{{varied}}},{{{a}}}]"));
    let recording = open(memory).unwrap();
    let file = "DepthMetadata.json";
    assert_eq!(
        recording.problems,
        [
            Problem::MetadataOutOfOrder { file, timestamp: 53692 },
            Problem::DuplicateMetadata { file, timestamps: vec![53692] },
            Problem::IntrinsicsVary {
                fx_px: [28.256, 28.257],
                cx_px: [16.03; 2],
                cy_px: [12.06; 2]
            },
        ]
    );
    assert_eq!(recording.frames[2].factory().unwrap().intrinsics.fx, 28.257);

    for (from, to, expected) in [
        (
            "LensDistortionLookupTable",
            "Other",
            "LensDistortionLookupTable is missing beside the other",
        ),
        (
            "LensDistortionInverseLookupTable",
            "Other",
            "LensDistortionInverseLookupTable is missing",
        ),
        (
            "(2016.0, 1512.0)",
            "(2016.0, 1134.0)",
            "2016x1134 have another shape than the depth map of 32x24",
        ),
    ] {
        let recording = open(replaced("DepthMetadata.json", from, to)).unwrap();
        assert_eq!(recording.problems.len(), 1, "{to}");
        assert!(recording.problems[0].to_string().contains(expected), "{}", recording.problems[0]);
        assert_eq!(recording.frames[0].factory().unwrap().tables, None, "{to}");
    }

    for (name, missing) in [("DepthMetadata.json", true), ("CameraMetadata.json", false)] {
        let mut files = Memory::new("rec");
        for (other, bytes) in good().files().iter().filter(|(other, _)| *other != name) {
            files.insert(other.clone(), bytes.clone());
        }
        let recording = open(files).unwrap();
        assert_eq!(recording.problems.len(), 1);
        assert_eq!(recording.problems[0].to_string().split(' ').next(), Some(name));
        assert_eq!(recording.factory().is_none(), missing);
    }
}

/// Without a lens table AVFoundation says the centre is (0, 0), and means that there is none.
#[test]
fn a_centre_without_tables() {
    let json = text(&good(), "DepthMetadata.json").replace("LookupTable", "Other");
    let mut memory = good();
    memory.insert("DepthMetadata.json", json.as_str());
    let recording = open(memory.clone()).unwrap();
    let center = recording.factory().unwrap().distortion_center.unwrap();
    assert!((center.x - 16.02).abs() < 1e-12, "{center:?}");
    let start = json.find("\"LensDistortionCenter\"").unwrap();
    let end = start + json[start..].find('\n').unwrap();
    memory.insert(
        "DepthMetadata.json",
        json.replace(&json[start..end], "\"LensDistortionCenter\" : \"(0.0, 0.0)\","),
    );
    assert_eq!(open(memory).unwrap().factory().unwrap().distortion_center, None);
}

#[test]
fn several_recordings_in_one_place() {
    let mut memory = Memory::new("Archive.zip");
    for folder in ["b/iPad", "a", "a/backup"] {
        for (name, bytes) in good().files() {
            memory.insert(format!("{folder}/{name}"), bytes.clone());
        }
    }
    let found = discover_in(Arc::new(memory.clone()), &Limits::default()).unwrap();
    let names: Vec<&str> = found.iter().map(|found| found.name.as_str()).collect();
    assert_eq!(names, ["a", "iPad"]); // The backup lies inside a recording.
    for found in found {
        let place = found.place();
        let recording = found.open().unwrap();
        assert_eq!((recording.frames.len(), recording.place()), (3, place.as_str()));
        assert_eq!(recording.gray(2).unwrap(), color(2).to_gray());
    }
    assert_message(
        &open(memory).unwrap_err(),
        &["Archive.zip holds 2 recordings (a, b/iPad): name one of them"],
    );
    // A single one is opened wherever it lies, and errors say where.
    let mut memory = Memory::new("Archive.zip");
    for (name, bytes) in good().files() {
        memory.insert(format!("x/iPad 5/{name}"), bytes.clone());
    }
    memory.insert("x/iPad 5/rgb_53692.png", *b"");
    let recording = open(memory).unwrap();
    assert_eq!(recording.name, "iPad 5");
    assert_message(&recording.gray(0).unwrap_err(), &["Archive.zip/x/iPad 5/rgb_53692.png: "]);
    assert_eq!(open(Memory::new("x")).map(|_| ()).unwrap_err().to_string().find('x'), Some(0));
}
