#![doc = include_str!("td204_rectified_twice.md")]

use super::{
    Basis, Case, Check, Code, Finding, Known, ToRecord, Unit, Verdict,
    td203_not_rectified::{self, evidence, numbers, why_unknown},
};
use crate::recording::{Defect, StreamState};

pub(super) const CHECK: Check = Check {
    title: "Rectified twice",
    unit: Unit::Px,
    basis: Basis::Views,
    tolerance: td203_not_rectified::CHECK.tolerance,
};

pub(super) fn check(case: &Case<'_>, known: &Known) -> Finding {
    let mut finding = Finding::new(Code::TD204, &case.tolerances);
    let Some(test) = case.distortion.filter(|_| case.poor_fit().is_none()) else {
        let claim =
            format!("Cannot tell whether the stream was rectified twice: {}.", why_unknown(case));
        return finding.unknown(claim, ToRecord::Corners);
    };
    // What was taken out too much bends against the lens.
    let [value, sigma] = [-test.corner_shift_px.value, test.corner_shift_px.sigma];
    let against = test.table_corner_shift_px.map_or(1.0, f64::signum);
    finding.value = Some(value * against);
    finding.sigma = Some(sigma);
    finding.evidence = evidence(test);
    let words = match known.state {
        StreamState::RectifiedTwice => {
            finding.verdict = Verdict::Fault;
            finding.defect = Some(Defect::RectifiedTwice);
            finding.what_to_do = "Do not apply the lookup table to this stream: it was straight already. Go back to \
                                  the images as recorded."
                .to_owned();
            "The stream was rectified twice"
        }
        StreamState::Distorted | StreamState::Rectified => {
            finding.verdict = Verdict::Ok;
            "The stream was not rectified twice"
        }
        StreamState::Unknown => {
            finding.record(ToRecord::Corners);
            "Cannot tell whether the stream was rectified twice"
        }
    };
    finding.claim = format!("{words}: {}.", numbers(test));
    finding
}
