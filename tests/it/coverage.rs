//! A small version of `cargo run --release --example coverage`: are the uncertainties true?

use truedepth::{
    audit::{Audit, judge},
    calibrate::{Estimate, MAX_VIEWS},
    depth::{NoiseBetweenFrames, patches},
    diagnose::{Code, Tolerances, Verdict},
    image::DepthMap,
    measure::{Method, Silent},
    recording::StreamState,
    simulate::{Device, Faults, Plan},
};

fn judged(device: &str, seed: u64, faults: &[&str]) -> (Plan, Audit) {
    judged_from(device, seed, faults, MAX_VIEWS)
}

fn judged_from(device: &str, seed: u64, faults: &[&str], max_views: usize) -> (Plan, Audit) {
    let mut plan = Plan::new(Device::named(device).expect("is known"), seed);
    plan.faults = Faults::parse(faults.iter().copied()).expect("can be");
    plan.n_frames = 15;
    let audit = audit_with(&plan, max_views, |_, depth| Some(depth));
    (plan, audit)
}

/// What is found where depth maps are what `depth` makes of them.
fn audit_with(
    plan: &Plan,
    max_views: usize,
    depth: impl Fn(usize, DepthMap) -> Option<DepthMap>,
) -> Audit {
    let measurer = plan.measurer(depth).expect("depth fits colour");
    let measured = measurer.finish(plan.about(), &Method::Auto, max_views, &Silent);
    judge(measured.expect("measures"), Tolerances::default())
}

fn faults(audit: &Audit) -> Vec<Code> {
    audit.findings.iter().filter(|f| f.verdict == Verdict::Fault).map(|f| f.code).collect()
}

/// Twelve sound recordings: no false fault, and errors of the size their sigmas say. The mean square of twelve normal
/// numbers lies between 0.18 and 2.8 in 99.8 % of cases.
#[test]
fn sigmas_and_verdicts_of_sound_recordings() {
    let mut squares = [0.0; 6];
    let n = 12;
    for i in 0..n {
        let device = ["ipad-12.9-5gen", "ipad-12.9-4gen", "iphone-13"][i % 3];
        let wavy: &[&str] = if i % 2 == 1 { &["bent=0.8mm"] } else { &[] };
        let (plan, audit) = judged(device, 50 + i as u64, wavy);
        let distorted = plan.stream() == StreamState::Distorted;
        let expected = if distorted { vec![Code::TD203] } else { Vec::new() };
        assert_eq!(faults(&audit), expected, "{device} {i}");
        let focal = audit.calibration.as_ref().expect("calibrates").focal_px();
        let found = audit.registration.as_ref().expect("registers");
        let [x, y] = found.shift_px;
        let z = |e: Estimate, truth: f64| ((e.value - truth) / e.sigma).powi(2);
        let each = [
            z(focal, plan.true_camera().intrinsics.fx),
            z(found.scale, 1.0),
            z(found.bias_m, 0.0),
            z(found.zoom, 1.0),
            z(x, 0.0),
            z(y, 0.0),
        ];
        for (sum, z2) in squares.iter_mut().zip(each) {
            *sum += z2 / n as f64;
        }
    }
    let names = ["focal", "scale", "bias", "zoom", "shift x", "shift y"];
    for (name, mean) in names.iter().zip(squares) {
        assert!((0.18..2.8).contains(&mean), "{name}: {squares:?}");
    }
}

/// A depth map that belongs to another moment takes nothing from what all others say: as if there were none.
#[test]
fn one_wrong_depth_map_does_not_count() {
    let mut plan = Plan::new(Device::named("ipad-12.9-5gen").expect("is known"), 71);
    plan.n_frames = 15;
    let wrong = |map: DepthMap| {
        let twisted = |i: usize| map.depth_m()[i] * (1.1 + 3e-4 * (i % 640) as f32);
        DepthMap::new(640, 480, (0..640 * 480).map(twisted).collect())
    };
    let of = |depth: &dyn Fn(DepthMap) -> Option<DepthMap>| {
        let found = audit_with(
            &plan,
            MAX_VIEWS,
            |frame, map| {
                if frame == 4 { depth(map) } else { Some(map) }
            },
        );
        found.measured.registration.expect("registers").slopes
    };
    let (without, with) = (of(&|_| None), of(&|map| Some(wrong(map))));
    let [[x, y], [also_x, also_y]] = [without.shift_px, with.shift_px];
    for (one, other) in [(without.zoom, with.zoom), (x, also_x), (y, also_y)] {
        assert!((one.value - other.value).abs() < 0.5 * one.sigma, "{without:?} {with:?}");
        assert!((other.sigma / one.sigma - 1.0).abs() < 0.2, "{without:?} {with:?}");
    }
}

/// As many views as are asked for, and the result still within its σ.
#[test]
fn an_audit_of_few_views() {
    let (_, few) = judged_from("ipad-12.9-5gen", 60, &[], 9);
    let calibration = few.calibration.as_ref().expect("calibrates");
    let chosen = calibration.chosen.as_ref().expect("fewer than there are");
    assert_eq!((calibration.views.len(), chosen.n_chosen), (9, 9));
    assert!(chosen.n_usable > 9, "{chosen:?}");
    let zoom = few.registration.as_ref().expect("registers").zoom;
    assert!((zoom.value - 1.0).abs() < 4.0 * zoom.sigma, "{zoom:?}");
}

/// Everything wrong with the depth at once, and each told for itself.
#[test]
fn faults_of_depth_are_told_apart() {
    let wrong = ["depth-zoom=0.9507", "depth-shift=3px,-2px", "depth-scale=1.5%", "depth-bias=5mm"];
    let (_, audit) = judged("ipad-12.9-5gen", 3, &wrong);
    assert_eq!(faults(&audit), [Code::TD301, Code::TD302, Code::TD401, Code::TD402]);
    let found = audit.measured.registration.expect("registers");
    assert!((1.0 - found.zoom.value) / found.zoom.sigma > 10.0, "{:?}", found.zoom);
    let [x, y] = found.shift_px;
    for (estimate, truth) in
        [(found.zoom, 0.9507), (x, 3.0), (y, -2.0), (found.scale, 1.015), (found.bias_m, 0.005)]
    {
        assert!((estimate.value - truth).abs() < 4.0 * estimate.sigma, "{truth}: {estimate:?}");
    }
    let (_, audit) = judged("ipad-12.9-5gen", 4, &["depth-mirrored"]);
    assert!(faults(&audit).contains(&Code::TD403), "{:?}", audit.handedness);
}

/// Depth maps of one and the same pose, each with noise of its own, quantised. Noise that reaches over 14 px is alike
/// in two of the pixels compared, so that fewer are independent than are counted.
#[test]
fn noise_between_frames_is_the_simulated_sensors() {
    let mut squares = Vec::new();
    for seed in 0..4 {
        let plan = Plan::new(Device::named("ipad-12.9-5gen").expect("is known"), seed);
        let [first, second] = plan.glimpses_of_one_pose(3);
        let corners = first.observation.corners.as_slice();
        let [before, after] = [&first, &second]
            .map(|glimpse| patches(&glimpse.depth, &plan.board, corners).expect("a board"));
        let mut found = NoiseBetweenFrames::default();
        found.add((corners, &before), (corners, &after));
        let found = found.finish();
        assert_eq!((found.n_successive, found.n_still), (1, 1));
        let truth = plan.truth().depth;
        for at in found.by_range {
            let noise_m = truth.noise_floor_m.hypot(at.depth_m.powi(2) * truth.noise_per_m);
            let expected_m = noise_m.hypot(truth.unit_m / 12_f64.sqrt());
            squares.push(((at.noise_m.value - expected_m) / at.noise_m.sigma).powi(2));
        }
    }
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    assert!(squares.len() >= 4 && mean < 4.0, "{squares:?}");
}
