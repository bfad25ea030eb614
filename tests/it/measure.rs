//! What is measured does not depend on the size of the images, and long recordings are thinned out.

use std::sync::Arc;

use truedepth::{
    calibrate::MAX_VIEWS,
    geom::Pixel,
    measure::{About, MAX_FRAMES_IN_FULL, Measurements, Measurer, Method, Silent},
    recording::{Frame, FrameImage},
    simulate::{Device, Plan},
};

fn plan(n_frames: usize) -> Plan {
    let mut plan = Plan::new(Device::named("ipad-12.9-5gen").expect("is known"), 3);
    plan.n_frames = n_frames;
    plan
}

/// The plan with a colour image `factor` times as large as its depth map.
fn measured(plan: &Plan, factor: usize) -> Measurements {
    let depth_factory = Arc::new(plan.factory());
    let size = depth_factory.size().map(|n| factor * n);
    let color_factory = Arc::new(depth_factory.at_size(size).expect("the same shape"));
    let image = |factory| Some(FrameImage { factory: Some(factory), ..FrameImage::named("image") });
    let mut measurer = Measurer::new(&plan.board);
    for index in 0..plan.n_frames {
        let mut glimpse = plan.glimpse(index);
        for corner in &mut glimpse.observation.corners {
            let Pixel { x, y } = corner.pixel;
            corner.pixel = Pixel::new(factor as f64 * x, factor as f64 * y);
            corner.sigma_px *= factor as f64;
        }
        let frame = Frame {
            id: index.to_string(),
            t_ns: 500_000_000 * index as i64,
            color: image(Arc::clone(&color_factory)),
            depth: image(Arc::clone(&depth_factory)),
        };
        let mut found = measurer.seen(&frame, size, glimpse.observation);
        measurer.look_at_depth(&mut found, &glimpse.depth, "here").expect("the same shape");
        measurer.add(found);
    }
    let about = About { factory: Some(plan.factory()), ..plan.about() };
    measurer.finish(about, &Method::Auto, MAX_VIEWS, &Silent).expect("measures")
}

#[test]
fn colour_may_be_larger_than_depth() {
    let plan = plan(16);
    let [one, three] = [1, 3].map(|factor| measured(&plan, factor));
    let focal = |m: &Measurements| m.calibration.as_ref().expect("calibrates").focal_px();
    let (a, b) = (focal(&one), focal(&three));
    assert!((b.value / a.value - 3.0).abs() < 1e-3 * 3.0, "{a:?} {b:?}");
    assert_eq!(three.factory.as_ref().expect("has one").size(), [1920, 1440]);
    let registration = |m: &Measurements| m.registration.clone().expect("registers");
    let (a, b) = (registration(&one), registration(&three));
    for (what, a, b) in [
        ("zoom", a.zoom, b.zoom),
        ("shift x", a.shift_px[0], b.shift_px[0]),
        ("shift y", a.shift_px[1], b.shift_px[1]),
        ("scale", a.scale, b.scale),
        ("bias", a.bias_m, b.bias_m),
    ] {
        assert!((a.value - b.value).abs() < 0.5 * a.sigma, "{what}: {a:?} {b:?}");
        assert!((b.sigma / a.sigma - 1.0).abs() < 0.2, "{what}: {a:?} {b:?}");
    }
    let error = |m: &Measurements| {
        let depth = m.own_depth.as_ref().expect("is compared");
        depth.mean_of_medians_m.expect("in many frames").value
    };
    assert!((error(&one) - error(&three)).abs() < 1e-4);
}

#[test]
fn of_a_long_recording_the_frames_that_differ_most_are_kept() {
    let plan = plan(330);
    let found = measured(&plan, 1);
    let n_seen = found.n_frames_with_board();
    assert_eq!(found.frames.len(), 330);
    assert!(n_seen > 310, "{n_seen}");
    assert_eq!(n_seen - found.n_frames_summarised(), MAX_FRAMES_IN_FULL);
    let frames = || found.frames.iter();
    assert!(frames().all(|f| f.in_full == (f.n_corners == f.observation.corners.len())));
    assert!(frames().all(|f| f.in_full || (f.patches.is_none() && f.holes.is_some())));
    let focal = found.calibration.as_ref().expect("calibrates").focal_px();
    let off = (focal.value - plan.truth().camera.focal_px) / focal.sigma;
    assert!(off.abs() < 4.0, "{focal:?}, {off} σ");
}
