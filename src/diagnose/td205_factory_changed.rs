#![doc = include_str!("td205_factory_changed.md")]

use super::{Case, Code, Evidence, Finding, Unit, Verdict};
use crate::recording::{Factory, Problem};

/// Factory numbers are printed to six digits and more; what differs by less is rounding.
const SAME_PERCENT: f64 = 1e-3;
/// A focal length that moves by so much is more than focus and stabilisation do, percent.
const LARGE_PERCENT: f64 = 1.0;

/// Within one recording: whether the metadata stay the same from frame to frame.
pub(super) fn check(case: &Case<'_>) -> Finding {
    let mut finding = Finding::new(Code::TD205, Unit::Percent);
    let vary = case.problems.iter().find_map(|problem| match problem {
        Problem::IntrinsicsVary { fx_px, cx_px, cy_px } => Some((fx_px, cx_px, cy_px)),
        _ => None,
    });
    if case.factory.is_none() {
        finding.summary = "The recording has no factory intrinsics to compare.".to_owned();
        finding.what_to_do = "Record with an app that saves the metadata.".to_owned();
        return finding;
    }
    let Some((fx, cx, cy)) = vary else {
        finding.verdict = Verdict::Ok;
        finding.value = Some(0.0);
        finding.summary =
            "The factory calibration is the same in all frames. `truedepth compare` compares \
                           recordings with each other."
                .to_owned();
        return finding;
    };
    let percent = 100.0 * (fx[1] / fx[0] - 1.0);
    finding.value = Some(percent);
    finding.evidence = vec![
        Evidence::number("fx_range_px", fx[1] - fx[0]),
        Evidence::number("cx_range_px", cx[1] - cx[0]),
        Evidence::number("cy_range_px", cy[1] - cy[0]),
    ];
    judge(&mut finding, percent, "from frame to frame");
    finding
}

/// Between two recordings of one device at the same image size.
pub fn factory_changed(first: &Factory, second: &Factory) -> Finding {
    let mut finding = Finding::new(Code::TD205, Unit::Percent);
    let (a, b) = (&first.intrinsics, &second.intrinsics);
    if [a.width, a.height] != [b.width, b.height] {
        finding.summary = format!(
            "Cannot compare factory calibrations for images of {}x{} and {}x{} px.",
            a.width, a.height, b.width, b.height
        );
        finding.what_to_do = "Compare recordings of one image size.".to_owned();
        return finding;
    }
    let percent = 100.0 * (b.focal_px() / a.focal_px() - 1.0);
    let (dx, dy) = (b.cx - a.cx, b.cy - a.cy);
    finding.value = Some(percent);
    finding.evidence = vec![
        Evidence::number("first_focal_px", a.focal_px()),
        Evidence::number("second_focal_px", b.focal_px()),
        Evidence::number("center_change_x_px", dx),
        Evidence::number("center_change_y_px", dy),
    ];
    if percent.abs() <= SAME_PERCENT && dx.hypot(dy) <= 0.01 {
        finding.verdict = Verdict::Ok;
        finding.summary = "Both recordings have the same factory calibration.".to_owned();
        return finding;
    }
    judge(&mut finding, percent, "between the recordings");
    finding
}

fn judge(finding: &mut Finding, percent: f64, when: &str) {
    let large = percent.abs() > LARGE_PERCENT;
    finding.verdict = if large { Verdict::Warning } else { Verdict::Info };
    finding.summary = format!(
        "The factory calibration changes {when}: the focal length by {:.3} %.",
        percent.abs()
    );
    finding.what_to_do = if large {
        "Do not calibrate frames of different calibrations together: the zoom, the camera or the device was changed."
    } else {
        "Use each frame's own intrinsics; the lens focuses and stabilises, and system updates calibrate anew."
    }
    .to_owned();
}
