//! The shared recordings of the paper's authors, as they are.

use truedepth::{
    board::CharucoBoard,
    files::Limits,
    recording::{Problem, Recording, discover},
};

use crate::data;

/// Folder below `zeiss/`, frames, metadata entries without images, factory fx in the file, whether it has tables.
const SETS: [(&str, usize, usize, f64, bool); 5] = [
    ("FrontCamCalibrationDataset/iPhone11Pro_iOS14", 50, 0, 436.4965, false),
    ("FrontCamCalibrationDataset/iPadPro12_4gen_iOS15", 25, 25, 595.33997, true),
    ("FrontCamCalibrationDataset/iPadPro12_5gen_iOS15", 25, 25, 565.12317, true),
    ("DepthEvalDataset/iPhone11Pro_iOS14", 5, 0, 436.77585, false),
    ("DepthEvalDataset/iPadPro12_5gen_iOS15", 5, 0, 565.12317, true),
];

#[test]
fn shared_recordings_read() {
    for (folder, n_frames, n_missing, fx, has_tables) in SETS {
        let Some(path) = data(&format!("zeiss/{folder}")) else { return };
        let recording = Recording::open(&path, &Limits::default()).unwrap();
        assert_eq!(recording.name, folder.rsplit('/').next().unwrap());
        assert_eq!(recording.frames.len(), n_frames, "{folder}");
        let board = recording.board.as_ref().unwrap();
        assert!((board.square_m - 0.020875).abs() < 1e-15, "{folder}: {} m", board.square_m);
        assert!(*board == CharucoBoard::paper(board.square_m).unwrap(), "{folder}");
        let missing: usize = recording
            .problems
            .iter()
            .map(|problem| match problem {
                Problem::MetadataWithoutImages { timestamps } => timestamps.len(),
                // The iPhone refocuses: its intrinsics differ by 5e-4.
                Problem::IntrinsicsVary { .. } if folder.contains("iPhone") => 0,
                other => panic!("{folder}: {other}"),
            })
            .sum();
        assert_eq!(missing, n_missing, "{folder}");

        let factory = recording.factory().unwrap();
        assert_eq!((factory.intrinsics.fx, factory.intrinsics.fy), (fx, fx), "{folder}");
        assert_eq!(factory.tables.is_some(), has_tables, "{folder}");
        assert_eq!(factory.depth_absolute, Some(true));
        assert_eq!(factory.depth_filtered, Some(false));
        assert_eq!(factory.geometric_distortion_correction, Some(folder.contains("5gen")));
        let device = factory.device_type.as_deref();
        assert_eq!(device, Some("AVCaptureDeviceTypeBuiltInTrueDepthCamera"));
        assert!((factory.pixel_size_m.unwrap() - 1e-6).abs() < 1e-12);
        // The paper's table: centre and principal point are one, but for the wide cameras of the 5gen.
        let center = factory.distortion_center.unwrap();
        let apart = (center.x - factory.intrinsics.cx).hypot(center.y - factory.intrinsics.cy);
        if folder.contains("iPhone") {
            assert!(apart < 1e-4, "{folder}: {apart} px");
        }
        if let Some(tables) = &factory.tables {
            assert_eq!(tables.inverse.magnification.len(), 42);
            assert_eq!(tables.inverse.center, center);
        }

        for i in [0, n_frames - 1] {
            let (gray, depth) = (recording.gray(i).unwrap(), recording.depth(i).unwrap());
            assert_eq!((gray.width(), gray.height()), (640, 480));
            assert_eq!((depth.width(), depth.height()), (640, 480));
            let mut near: Vec<f32> =
                depth.depth_m().iter().copied().filter(|d| d.is_finite()).collect();
            near.sort_by(f32::total_cmp);
            assert!(
                (0.1..2.0).contains(&near[near.len() / 2]),
                "{folder}: {}",
                near[near.len() / 2]
            );
            assert_eq!(recording.color(i).unwrap().to_gray(), gray);
        }
        let times: Vec<i64> = recording.frames.iter().map(|frame| frame.t_ns).collect();
        assert!(times[0] == 0 && times.is_sorted());
    }
}

#[test]
fn several_recordings_are_found_by_name() {
    let Some(path) = data("zeiss") else { return };
    let found = discover(&path, &Limits::default()).unwrap();
    let mut places: Vec<String> = found.iter().map(|found| found.place()).collect();
    let mut expected: Vec<String> =
        SETS.iter().map(|(folder, ..)| path.join(folder).display().to_string()).collect();
    places.sort();
    expected.sort();
    assert_eq!(places, expected);
    let message = Recording::open(&path, &Limits::default()).unwrap_err().to_string();
    assert!(
        message.contains("5 recordings") && message.contains("DepthEvalDataset/iPhone11Pro_iOS14"),
        "{message}"
    );
}
