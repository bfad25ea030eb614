//! Corrected recordings: simulated ones against their truth, the published ones against the paper's numbers.

use std::sync::Arc;

use truedepth::{
    audit::{Audit, Options, audit},
    board::CharucoBoard,
    camera::{Camera, Distortion, Intrinsics},
    correct::{Plan, Sampling, Selection, correct},
    diagnose::{Code, Verdict},
    files::{Limits, Memory},
    image::{DepthMap, Rgb},
    measure::{Method, Silent},
    recording::{Defect, Factory, Frame, FrameImage, Recording},
    simulate::{Device, Faults, Plan as Simulation},
};

use crate::data;

fn run(recording: &Recording) -> Audit {
    audit(recording, &Options::new(Method::Auto), &Silent).expect("audits")
}

fn opened(memory: Memory) -> Recording {
    Recording::from_files(Arc::new(memory), &Limits::default()).expect("opens")
}

fn faults(audit: &Audit) -> Vec<Code> {
    audit.findings.iter().filter(|f| f.verdict == Verdict::Fault).map(|f| f.code).collect()
}

fn applied(recording: &Recording, plan: &Plan) -> Recording {
    let mut sink = Memory::new("corrected");
    correct(recording, plan, &mut sink).expect("corrects");
    opened(sink)
}

/// Points of the board in the camera's frame as a user of the corrected recording gets them (corner in the image, depth
/// there, the metadata's pinhole) against where they truly were: median of the distances over range.
fn cloud_error(simulation: &Simulation, recording: &Recording, audit: &Audit) -> f64 {
    let pinhole = recording.factory().expect("has metadata").intrinsics;
    let mut errors = Vec::new();
    for (index, frame) in audit.frames.iter().enumerate() {
        let scene = simulation.scene(index);
        let depth = recording.depth(index).expect("decodes");
        for corner in &frame.observation.corners {
            let truth = scene.color_from_board * scene.printed_corner(corner.id);
            let Some(z) = depth.bilinear(corner.pixel) else { continue };
            let [u, v] = pinhole.ray_from_pixel(corner.pixel);
            let offset = (truth.x() - u * z).hypot(truth.y() - v * z).hypot(truth.z() - z);
            errors.push(offset / truth.x().hypot(truth.y()).hypot(truth.z()));
        }
    }
    assert!(errors.len() > 300, "{} corners with depth", errors.len());
    errors.sort_by(f64::total_cmp);
    errors[errors.len() / 2]
}

fn simulated(faults: &[&str]) -> (Simulation, Recording) {
    let mut simulation = Simulation::new(Device::named("ipad-12.9-5gen").expect("known"), 3);
    simulation.faults = Faults::parse(faults.iter().copied()).expect("known");
    simulation.n_frames = 14;
    let memory = simulation.write(Memory::new("simulated"), |_| ()).expect("renders");
    (simulation, opened(memory))
}

/// What is found is corrected as found, and gone; and the cloud is the true one. Together the groups hold every fault
/// that has a finding.
#[test]
fn simulated_faults_go() {
    for group in [
        &["focal=6.6%", "depth-scale=1.5%"][..],
        &["distorted", "depth-zoom=0.9507"],
        &["rectified-twice", "depth-shift=3px,0px"],
        &["mirrored"],
        &["depth-mirrored"],
        &["center=4px,-2px"],
    ] {
        let (simulation, recording) = simulated(group);
        let before = run(&recording);
        assert!(faults(&before).len() >= group.len(), "{group:?}: {:?}", faults(&before));
        let plan = Plan::of_audit(&before, Selection::Faults).expect("a way back");
        let fixed = applied(&recording, &plan);
        let after = run(&fixed);
        assert_eq!(faults(&after), [], "{group:?}");
        let (was, is) = (
            cloud_error(&simulation, &recording, &before),
            cloud_error(&simulation, &fixed, &after),
        );
        // 0.06 % is what the simulated sensor's noise leaves of a faultless recording.
        assert!(is < 0.001 && is < 0.6 * was, "{group:?}: {was} before, {is} after");
    }
}

/// What is told is undone, without an audit.
#[test]
fn told_faults_go() {
    let (simulation, recording) = simulated(&["center=4px,-2px", "depth-bias=2mm"]);
    let plan = Plan::given(simulation.faults.defects()).expect("a plan");
    let fixed = applied(&recording, &plan);
    let (before, after) = (run(&recording), run(&fixed));
    let was = cloud_error(&simulation, &recording, &before);
    let is = cloud_error(&simulation, &fixed, &after);
    assert!(was > 0.005 && is < 0.001, "{was} before, {is} after");
}

/// A bias within its tolerance is no fault. Asked for it goes, as a step or as what is significant.
#[test]
fn what_is_significant_goes_when_asked() {
    let (simulation, recording) = simulated(&["depth-bias=2mm"]);
    let before = run(&recording);
    assert_eq!(faults(&before), []);
    let was = cloud_error(&simulation, &recording, &before);
    assert!(Plan::of_audit(&before, Selection::Faults).expect("a plan").is_empty());
    for selection in [Selection::Significant, Selection::Only(&["depth"])] {
        let plan = Plan::of_audit(&before, selection).expect("a plan");
        let fixed = applied(&recording, &plan);
        let after = run(&fixed);
        let is = cloud_error(&simulation, &fixed, &after);
        assert!(was > 0.003 && is < 0.001, "{selection:?}: {was} before, {is} after");
    }
}

/// The paper's issue 1 on the published recording of a 4gen iPad: its depth zoomed by 1/0.9507, as ARKit delivers it.
#[test]
fn zoomed_depth_of_the_real_ipad_is_found_and_goes() {
    let Some(path) = data("zeiss/FrontCamCalibrationDataset/iPadPro12_4gen_iOS15") else { return };
    let real = Recording::open(&path, &Limits::default()).expect("opens");
    let zoomed = applied(
        &real,
        &Plan::given(&[Defect::DepthZoom { zoom: [1.0 / 0.9507; 2] }]).expect("a plan"),
    );
    let before = run(&zoomed);
    assert!(faults(&before).contains(&Code::TD401), "{:?}", faults(&before));
    let found = before.registration.as_ref().expect("depth on the board").zoom;
    let plan = Plan::of_audit(&before, Selection::Faults).expect("a way back");
    let fixed = applied(&zoomed, &plan);
    let after = run(&fixed);
    assert_eq!(faults(&after), []);
    let left = after.registration.as_ref().expect("depth on the board").zoom;
    // The untouched recording itself is at 0.993 +- 0.006.
    assert!((found.value - 0.9507).abs() < 3.0 * found.sigma, "{found:?}");
    assert!((left.value - 1.0).abs() < 0.005, "{left:?}");
    // Files that belong to no frame, and keys that are not understood, are carried over.
    assert_eq!(fixed.file("Gyroscope.txt"), real.file("Gyroscope.txt"));
    let metadata = String::from_utf8(fixed.file("CameraMetadata.json").unwrap()).unwrap();
    assert!(metadata.contains("\"LensAperture\" : 2.2000000476837158"));
    assert!(metadata.contains("\"GeometricDistortionCorrectionEnabled\" : true"));
    assert!(fixed.factory().unwrap().tables.is_none(), "zeroed tables are none");
}

/// The paper's issue 2: fronto-parallel frames of a 5gen iPad by the camera of another recording of it.
#[test]
fn focal_length_of_the_real_ipad() {
    let Some(moving) = data("zeiss/FrontCamCalibrationDataset/iPadPro12_5gen_iOS15") else {
        return;
    };
    let Some(still) = data("zeiss/DepthEvalDataset/iPadPro12_5gen_iOS15") else { return };
    let camera = run(&Recording::open(&moving, &Limits::default()).expect("opens"))
        .measured
        .camera
        .expect("calibrates");
    let recording = Recording::open(&still, &Limits::default()).expect("opens");
    let said = recording.factory().expect("has metadata").intrinsics;
    let fixed = applied(&recording, &Plan::of_camera(&camera, &said).expect("a plan"));
    let error_mm = |recording: &Recording| {
        1e3 * run(recording)
            .measured
            .factory_depth
            .expect("depth")
            .mean_of_medians_m
            .expect("frames")
            .value
    };
    let (before, after) = (error_mm(&recording), error_mm(&fixed));
    assert!((before - 13.7).abs() < 0.2, "{before}");
    assert!(after.abs() < 2.0, "{after}");
    // Only metadata change: images are the very bytes.
    if camera.distortion == Distortion::None {
        let name = recording.frames[0].depth.as_ref().expect("has depth").file.as_str();
        assert_eq!(fixed.file(name), recording.file(name));
    }
}

#[test]
fn mirroring_twice_is_nothing_and_a_wrong_camera_is_refused() {
    let (_, recording) = simulated(&["focal=1%"]);
    let unmirror = Plan::given(&[Defect::Mirrored]).unwrap().sampled(Sampling::Nearest);
    let twice = applied(&applied(&recording, &unmirror), &unmirror);
    assert_eq!(twice.color(3).unwrap(), recording.color(3).unwrap());
    let same = |a: &Recording, b: &Recording| {
        let (a, b) = (a.depth(3).unwrap(), b.depth(3).unwrap());
        a.depth_m().iter().zip(b.depth_m()).all(|(a, b)| a.to_bits() == b.to_bits())
    };
    assert!(same(&twice, &recording));
    assert!(!same(&applied(&recording, &unmirror), &recording));

    let said = recording.factory().unwrap().intrinsics;
    let intrinsics = truedepth::camera::Intrinsics { width: 320, ..said };
    let lens = truedepth::camera::Brown { k1: 0.1, k2: 0.0, p1: 0.0, p2: 0.0, k3: 0.0 };
    let camera = Camera { intrinsics, distortion: Distortion::Brown(lens) };
    let plan = Plan::of_camera(&camera, &said).unwrap();
    let mut sink = Memory::new("never");
    let error = correct(&recording, &plan, &mut sink).unwrap_err();
    assert!(error.to_string().contains("320x480") && sink.files().is_empty(), "{error}");
}

/// Whatever was read, our own layout is written: here images in memory, colour three times as large as depth.
#[test]
fn a_recording_in_memory_is_corrected() {
    let k = Intrinsics { fx: 9.0, fy: 9.0, cx: 3.5, cy: 2.5, width: 8, height: 6 };
    let factory = Arc::new(Factory::pinhole(k));
    let large = Arc::new(factory.at_size([24, 18]).expect("the same shape"));
    let image = |file: &str, factory: &Arc<Factory>| {
        let (size, factory) = (Some(factory.size()), Some(Arc::clone(factory)));
        Some(FrameImage { file: file.into(), size, factory })
    };
    let frames = (0..3)
        .map(|i| {
            let frame = Frame {
                id: format!("number {i}"),
                t_ns: i * 33_333_333,
                color: image("c", &large),
                depth: image("d", &factory),
            };
            let color = Rgb::new(24, 18, vec![[i as u8; 3]; 24 * 18]);
            (frame, Some(color), Some(DepthMap::new(8, 6, vec![0.505; 48])))
        })
        .collect();
    let board = CharucoBoard::paper(0.020875).expect("a board");
    let recording = Recording::in_memory("phone", Some(board.clone()), frames);
    let defects = [Defect::DepthScale { ratio: 1.01 }, Defect::Focal { ratio: 1.125 }];
    let plan = Plan::given(&defects).expect("can be");
    let mut files = Memory::new("corrected");
    let done = correct(&recording, &plan, &mut files).expect("corrects");
    assert_eq!((done.n_frames, done.files.len()), (3, 0));
    let corrected = Recording::from_files(Arc::new(files), &Limits::default()).expect("opens");
    assert_eq!(corrected.problems, []);
    assert!(corrected.board == Some(board));
    let times: Vec<i64> = corrected.frames.iter().map(|frame| frame.t_ns).collect();
    assert_eq!(times, [0, 33_000_000, 66_000_000]);
    for (i, frame) in corrected.frames.iter().enumerate() {
        assert_eq!(corrected.color(i).expect("decodes"), recording.color(i).expect("is there"));
        assert!((corrected.depth(i).expect("decodes").at(3, 3) - 0.5).abs() < 1e-6);
        let of = |image: &Option<FrameImage>| image.as_ref()?.factory.clone();
        let (color, depth) = (of(&frame.color).expect("known"), of(&frame.depth).expect("known"));
        assert_eq!((depth.intrinsics.fx, color.intrinsics.fx), (8.0, 24.0));
        assert_eq!(color.size(), [24, 18]);
    }
}
