#![doc = include_str!("td205_factory_changed.md")]

use super::{
    Basis, Case, Check, Code, Evidence, Finding, Known, SameApi, Side, ToRecord, Tolerances, Unit,
    Verdict, numbers::signed,
};
use crate::recording::Problem;

pub(super) const CHECK: Check = Check {
    title: "Factory calibration changed",
    unit: Unit::Percent,
    basis: Basis::Metadata,
    tolerance: None,
};

/// Factory numbers are printed to six digits and more; what differs by less is rounding.
const SAME_PERCENT: f64 = 1e-3;
/// A focal length that moves by so much is more than focus and stabilisation do, percent.
const LARGE_PERCENT: f64 = 1.0;

/// Within one recording: whether the metadata stay the same from frame to frame.
pub(super) fn check(case: &Case<'_>, _: &Known) -> Finding {
    let mut finding = Finding::new(Code::TD205, &case.tolerances);
    let vary = case.problems.iter().find_map(|problem| match problem {
        Problem::IntrinsicsVary { fx_px, cx_px, cy_px } => Some((fx_px, cx_px, cy_px)),
        _ => None,
    });
    if case.factory.is_none() {
        let claim = "The recording has no factory intrinsics to compare.".to_owned();
        return finding.unknown(claim, ToRecord::Metadata);
    }
    let Some((fx, cx, cy)) = vary else {
        finding.verdict = Verdict::Ok;
        finding.value = Some(0.0);
        finding.claim =
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

/// Between two recordings of one device under one API.
pub(super) fn between(first: &Side, second: &Side, same: &SameApi) -> Finding {
    let mut finding = Finding::new(Code::TD205, &Tolerances::default());
    let percent = 100.0 * same.focal_difference;
    finding.value = Some(percent);
    finding.evidence = vec![
        Evidence::number("first_focal_px", first.sheet.focal_px),
        Evidence::number("second_focal_px", second.sheet.focal_px),
        Evidence::number("center_shift_x_px", same.center_shift_px[0]),
        Evidence::number("center_shift_y_px", same.center_shift_px[1]),
    ];
    if !same.same_unit {
        finding.verdict = Verdict::Unknown;
        let [x, y] = same.center_shift_px;
        finding.claim = format!(
            "The two are not of one device, or its whole calibration was made anew: the principal points lie \
             ({}, {}) px apart at the reference dimensions.",
            signed(x, 2),
            signed(y, 2)
        );
        finding.what_to_do = "Compare recordings of one device.".to_owned();
    } else if same.focal_difference.abs() <= SAME_PERCENT / 100.0 {
        finding.verdict = Verdict::Ok;
        finding.claim = "The factory calibration is the same in both.".to_owned();
    } else {
        finding.verdict = Verdict::Warning;
        finding.claim = format!(
            "The factory calibration of one device has changed: focal length {:.2} px, then {:.2} px at the reference \
             dimensions ({} %), with principal point and distortion centre as before.",
            first.sheet.focal_px,
            second.sheet.focal_px,
            signed(percent, 3)
        );
        finding.what_to_do = "Keep the metadata with each recording and use its own: the paper saw such a change with \
                              an update of the system, and an iPhone shows one from recording to recording. It is no \
                              sign that either value is right."
            .to_owned();
    }
    finding
}

fn judge(finding: &mut Finding, percent: f64, when: &str) {
    let large = percent.abs() > LARGE_PERCENT;
    finding.verdict = if large { Verdict::Warning } else { Verdict::Info };
    finding.claim = format!(
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
