//! The detector on photos of other cameras and boards, beside OpenCV 5's own corners, and on photos without a board.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use serde_json::Value;
use truedepth::{
    board::CharucoBoard,
    detect::{Detector, Observation},
    geom::Pixel,
    image::{Gray, Limits},
};

/// OpenCV's corners and ours may differ by this: the photos are sharp, and OpenCV refines in windows of its own size.
const AGREE_PX: f64 = 1.5;

fn seen(detector: &Detector, path: &Path) -> Observation {
    let bytes = fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let image = Gray::decode(&bytes, &Limits::default())
        .unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    detector.detect(&image)
}

/// OpenCV 5's corners of a set of photos: by path below the folder, by id.
fn opencv(root: &Path, set: &str) -> BTreeMap<String, BTreeMap<usize, Pixel>> {
    let bytes = fs::read(root.join("opencv5.json")).expect("opencv5.json");
    let document: Value = serde_json::from_slice(&bytes).expect("JSON");
    let images = document["sets"][set]["images"].as_object().expect("images by path");
    let corners = |image: &Value| {
        let Some(corners) = image["new"]["charuco"].as_object() else { return BTreeMap::new() };
        corners
            .iter()
            .map(|(id, at)| {
                let coordinate = |k: usize| at[k].as_f64().expect("a number");
                (id.parse().expect("an id"), Pixel::new(coordinate(0), coordinate(1)))
            })
            .collect()
    };
    images.iter().map(|(path, image)| (path.clone(), corners(image))).collect()
}

/// Compares with OpenCV: every corner of its own must be ours, too, and at the same place. Answers with the numbers.
fn beside_opencv(root: &Path, set: &str, board: &str) -> String {
    let board: CharucoBoard = board.parse().expect("a board");
    let detector = Detector::new(&board);
    let (mut n_opencv, mut n_ours) = (0, 0);
    let mut distances = Vec::new();
    let mut missed = Vec::new();
    for (path, theirs) in opencv(root, set) {
        let observation = seen(&detector, &root.join(&path));
        let ours: BTreeMap<usize, Pixel> =
            observation.corners.iter().map(|c| (c.id, c.pixel)).collect();
        n_opencv += theirs.len();
        n_ours += ours.len();
        for (id, at) in theirs {
            let name = format!("corner {id} of {path}");
            match ours.get(&id) {
                Some(own) => distances.push((own.distance(at), name)),
                None => missed.push(name),
            }
        }
    }
    distances.sort_by(|a, b| a.0.total_cmp(&b.0));
    let median = distances[distances.len() / 2].0;
    let (worst, name) = distances.last().expect("a corner that both found");
    assert!(missed.is_empty(), "only OpenCV found {missed:?}");
    assert!(*worst <= AGREE_PX, "{name} is {worst:.2} px from OpenCV's");
    format!(
        "{set}: OpenCV 5 {n_opencv} corners, ours {n_ours}, both {}; apart: median {median:.3} px, worst {worst:.3} px \
         ({name})",
        distances.len(),
    )
}

#[test]
fn the_tutorials_of_opencv() {
    let Some(root) = crate::data("opencv-aruco-tutorials") else { return };
    println!("{}", beside_opencv(&root, "charuco_5x7", "5x7:40mm:20mm:6X6_250"));
}

#[test]
fn a_realsense_on_a_robot() {
    let Some(root) = crate::data("realsense-handeye") else { return };
    println!("{}", beside_opencv(&root, "intrinsics_gray", "7x5:30mm:21mm:4X4_50"));
}

/// Photos and drawings in which this board is not, many with other markers in them.
#[test]
fn no_board_in_photos_of_other_things() {
    let mut images: Vec<PathBuf> = Vec::new();
    for folder in
        ["opencv-aruco-tutorials/images", "jpeg-depth", "realsense-handeye/intrinsics_gray"]
    {
        let Some(folder) = crate::data(folder) else { return };
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("it lists").path();
            if path.extension().is_some_and(|e| e == "png" || e == "jpg") {
                images.push(path);
            }
        }
    }
    assert!(images.len() > 40, "{}", images.len());
    let board: CharucoBoard = "10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL".parse().expect("a board");
    let detector = Detector::new(&board);
    for path in images {
        let observation = seen(&detector, &path);
        let (name, identity) = (path.display(), observation.identity);
        assert!(observation.corners.is_empty() && identity.is_none(), "{name}: {identity:?}");
    }
}

/// The frames are raw BGRA; green is as good as grey here.
#[test]
fn no_board_on_a_box_and_a_can() {
    let Some(root) = crate::data("truedepth-boxcan") else { return };
    let board: CharucoBoard = "10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL".parse().expect("a board");
    let detector = Detector::new(&board);
    for name in ["video01.bin", "video10.bin", "video30.bin"] {
        let bytes = fs::read(root.join(name)).expect(name);
        let pixels: Vec<u8> = bytes.as_chunks::<4>().0.iter().map(|&[_, g, _, _]| g).collect();
        assert_eq!(pixels.len(), 640 * 480, "{name}");
        let observation = detector.detect(&Gray::new(640, 480, pixels));
        assert!(observation.corners.is_empty(), "{name}: {:?}", observation.identity);
    }
}
