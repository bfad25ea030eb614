#![doc = include_str!("td302_depth_bias.md")]

use super::{
    Case, Code, Correction, Evidence, Finding, Unit, Verdict,
    td201_focal_length::Measured,
    td301_depth_scale::{RECORD, Scaled, why_unknown},
};

pub(super) fn check(case: &Case<'_>, focal: Option<&Measured>) -> Finding {
    let mut finding = Finding::new(Code::TD302, Unit::Mm);
    let tolerance_m = case.tolerances.depth_bias_m;
    finding.tolerance = Some(1e3 * tolerance_m);
    let line = case.own_depth.and_then(|d| d.line.as_ref());
    let (Some(line), Some(focal)) = (line, focal) else {
        finding.summary = format!("Cannot tell whether depth has a bias: {}.", why_unknown(case));
        RECORD.clone_into(&mut finding.what_to_do);
        return finding;
    };
    let Scaled { offset_m, .. } = Scaled::new(line, focal);
    let by_bias = Verdict::of(line.bias_m, tolerance_m);
    let by_offset = Verdict::of(offset_m, tolerance_m);
    // An offset at the recorded distances that is surely small is good enough; one that is not may be a scale just as
    // well, and is TD301's to judge.
    let offset_is_small = matches!(by_offset, Verdict::Ok | Verdict::Info);
    let (verdict, deviation_m, basis) = if by_bias == Verdict::Unknown && offset_is_small {
        (
            by_offset,
            offset_m,
            "at the mean of the recorded distances; they are too alike to follow depth down to 0 m",
        )
    } else {
        (by_bias, line.bias_m, "where a robust line of sensor over board meets 0 m")
    };
    finding.verdict = verdict;
    finding.value = Some(1e3 * deviation_m.value);
    finding.sigma = Some(1e3 * deviation_m.sigma);
    finding.evidence = vec![
        Evidence::estimate("bias_m", line.bias_m),
        Evidence::estimate("offset_at_center_m", offset_m),
        Evidence::number("center_m", line.center_m),
        Evidence::number("correlation_with_scale", line.correlation),
    ];
    let words = match verdict {
        Verdict::Fault => "Depth has a bias",
        Verdict::Info => "Depth has a bias within the tolerance",
        Verdict::Ok => "Depth has no bias",
        Verdict::Unknown | Verdict::Warning => "Cannot tell whether depth has a bias",
    };
    finding.summary = format!(
        "{words}: {:+.2} +- {:.2} mm, sensor minus board ({basis}; tolerance {:.1} mm).",
        1e3 * deviation_m.value,
        1e3 * deviation_m.sigma,
        1e3 * tolerance_m,
    );
    match verdict {
        Verdict::Fault => {
            finding.what_to_do = format!(
                "Subtract {:.2} mm from depth, after TD301's scale.",
                1e3 * deviation_m.value
            );
            finding.correction = Some(Correction::Depth { scale: 1.0, bias_m: deviation_m.value });
        }
        Verdict::Unknown | Verdict::Warning => RECORD.clone_into(&mut finding.what_to_do),
        Verdict::Info | Verdict::Ok => {}
    }
    finding
}
