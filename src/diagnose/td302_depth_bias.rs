#![doc = include_str!("td302_depth_bias.md")]

use super::{
    Case, Code, Evidence, Finding, Unit, Verdict,
    td201_focal_length::Measured,
    td301_depth_scale::{RECORD, Scaled, basis, divisor},
};
use crate::recording::Defect;

pub(super) fn check(case: &Case<'_>, focal: Option<&Measured>) -> Finding {
    let mut finding = Finding::new(Code::TD302, Unit::Mm);
    let tolerance_m = case.tolerances.depth_bias_m;
    finding.tolerance = Some(1e3 * tolerance_m);
    let (found, focal) = match basis(case, focal) {
        Ok(both) => both,
        Err(why) => {
            finding.summary = format!("Cannot tell whether depth has a bias: {why}.");
            RECORD.clone_into(&mut finding.what_to_do);
            return finding;
        }
    };
    let scaled = Scaled::new(found, focal);
    let offset_m = scaled.offset_m();
    let judge = |deviation_m| Verdict::of(deviation_m, tolerance_m);
    let somewhere = scaled.errors_m.into_iter().any(|error_m| judge(error_m) == Verdict::Fault);
    let by_bias = judge(found.bias_m);
    let doubtful = by_bias == Verdict::Unknown || (by_bias == Verdict::Fault && !somewhere);
    // An offset at the recorded distances that is surely small is good enough; one that is not may be a scale just as
    // well, and is TD301's to judge.
    let by_offset = judge(offset_m);
    let (verdict, deviation_m, place) =
        if doubtful && matches!(by_offset, Verdict::Ok | Verdict::Info) {
            (
                by_offset,
                offset_m,
                "at the mean of the recorded distances; followed down to 0 m it would be a guess",
            )
        } else if doubtful {
            (Verdict::Unknown, found.bias_m, "where the line of sensor over board meets 0 m")
        } else {
            (by_bias, found.bias_m, "where the line of sensor over board meets 0 m")
        };
    finding.verdict = verdict;
    finding.value = Some(1e3 * deviation_m.value);
    finding.sigma = Some(1e3 * deviation_m.sigma);
    finding.evidence = vec![
        Evidence::estimate("bias_m", found.bias_m),
        Evidence::estimate("offset_at_center_m", offset_m),
        Evidence::number("center_m", found.center_m),
        Evidence::number("correlation_with_scale", found.scale_bias_correlation()),
    ];
    // One line goes through the recorded distances, and both findings correct it: what TD301's scale leaves there.
    let divisor = divisor(case, found, &scaled);
    let bias_m = offset_m.value - (divisor - 1.0) * found.center_m;
    let words = match verdict {
        Verdict::Fault => "Depth has a bias",
        Verdict::Info => "Depth has a bias within the tolerance",
        Verdict::Ok => "Depth has no bias",
        Verdict::Unknown | Verdict::Warning => "Cannot tell whether depth has a bias",
    };
    finding.summary = format!(
        "{words}: {:+.2} +- {:.2} mm, sensor minus board ({place}; tolerance {:.1} mm).",
        1e3 * deviation_m.value,
        1e3 * deviation_m.sigma,
        1e3 * tolerance_m,
    );
    match verdict {
        Verdict::Fault => {
            finding.what_to_do = format!(
                "Subtract {:.2} mm from depth{}.",
                1e3 * bias_m,
                if divisor == 1.0 { "" } else { ", then divide it as TD301 says" }
            );
        }
        Verdict::Unknown | Verdict::Warning => RECORD.clone_into(&mut finding.what_to_do),
        Verdict::Info | Verdict::Ok => {}
    }
    // Where the scale tells it all nothing is left.
    if bias_m.abs() > 1e-6 {
        finding.name_if_significant(Defect::DepthBias { bias_m });
    }
    finding
}
