#![doc = include_str!("td204_rectified_twice.md")]

use super::{
    Case, Code, Finding, Unit, Verdict,
    td203_not_rectified::{RECORD, evidence, numbers, why_unknown},
};
use crate::recording::{Defect, StreamState};

pub(super) fn check(case: &Case<'_>, state: StreamState) -> Finding {
    let mut finding = Finding::new(Code::TD204, Unit::Px);
    finding.tolerance = Some(case.tolerances.distortion_px);
    let Some(test) = case.distortion.filter(|_| case.poor_fit().is_none()) else {
        finding.summary =
            format!("Cannot tell whether the stream was rectified twice: {}.", why_unknown(case));
        RECORD.clone_into(&mut finding.what_to_do);
        return finding;
    };
    // What was taken out too much bends against the lens.
    let [value, sigma] = [-test.corner_shift_px.value, test.corner_shift_px.sigma];
    let against = test.table_corner_shift_px.map_or(1.0, f64::signum);
    finding.value = Some(value * against);
    finding.sigma = Some(sigma);
    finding.evidence = evidence(test);
    let words = match state {
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
            RECORD.clone_into(&mut finding.what_to_do);
            "Cannot tell whether the stream was rectified twice"
        }
    };
    finding.summary = format!("{words}: {}.", numbers(test));
    finding
}
