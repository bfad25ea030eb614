//! What a recording and its files are called, and which frame comes first, is no evidence.

use std::sync::Arc;

use truedepth::{
    audit::{Audit, Options, audit},
    calibrate::Estimate,
    files::{Limits, Memory},
    measure::{Method, Silent},
    recording::{FrameImage, Recording, Writer},
    simulate::{Device, Faults, Plan},
};

fn audited(recording: &Recording) -> Audit {
    audit(recording, &Options::new(Method::Auto), &Silent).expect("audits")
}

fn open(files: Memory) -> Recording {
    Recording::from_files(Arc::new(files), &Limits::default()).expect("opens")
}

/// The same pictures under other names and timestamps, in another order.
fn renamed(recording: &Recording) -> Recording {
    let mut writer = Writer::new(Memory::new("another/name"));
    let n = recording.frames.len();
    for place in 0..n {
        // Every frame once: n has no factor 5.
        let frame = &recording.frames[(5 * place + 3) % n];
        let file = |image: &Option<FrameImage>| {
            recording.file(&image.as_ref().expect("has both images").file).expect("reads")
        };
        let factory = frame.factory().expect("has metadata");
        let timestamp = 77_000 + 310 * place as i64;
        writer
            .encoded_frame(timestamp, &file(&frame.color), &file(&frame.depth), factory)
            .expect("writes");
    }
    writer.board(recording.board.as_ref().expect("has a board")).expect("writes");
    open(writer.finish().expect("finishes"))
}

fn same(what: &str, a: Estimate, b: Estimate) {
    assert!((a.value - b.value).abs() < 1e-3 * a.sigma, "{what}: {a:?} {b:?}");
    assert!((a.sigma / b.sigma - 1.0).abs() < 1e-3, "{what}: {a:?} {b:?}");
}

#[test]
fn names_and_order_say_nothing() {
    let device = Device::named("ipad-12.9-5gen").expect("is known");
    let mut plan = Plan::new(device, 5);
    plan.faults = Faults::parse(["focal=6.6%", "depth-zoom=0.9507", "bent=0.8mm"]).expect("can be");
    plan.n_frames = 14;
    let recording = open(plan.write(Memory::new("as taken"), |_| ()).expect("writes"));
    let (first, second) = (audited(&recording), audited(&renamed(&recording)));

    let [a, b] = [&first, &second].map(|audit| audit.calibration.as_ref().expect("calibrates"));
    assert_eq!(a.model, b.model);
    assert_eq!((a.views.len(), a.n_pictures), (b.views.len(), b.n_pictures));
    assert!((a.rms_px - b.rms_px).abs() < 1e-6);
    same("focal length", a.focal_px(), b.focal_px());
    let [a, b] = [&first, &second].map(|audit| audit.registration.as_ref().expect("registers"));
    same("scale", a.scale, b.scale);
    same("bias", a.bias_m, b.bias_m);
    same("zoom", a.zoom, b.zoom);
    (0..2).for_each(|axis| same("shift", a.shift_px[axis], b.shift_px[axis]));
    let [a, b] = [&first, &second]
        .map(|audit| audit.findings.iter().map(|f| (f.code, f.verdict)).collect::<Vec<_>>());
    assert_eq!(a, b);
}
