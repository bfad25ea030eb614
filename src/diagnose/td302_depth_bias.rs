#![doc = include_str!("td302_depth_bias.md")]

use super::{
    Basis, Case, Check, Code, Evidence, Finding, Known, ToRecord, Tolerance, Unit, Verdict,
    numbers::{in_mm, plain, signed, value_and_sigma},
    td301_depth_scale::{Scaled, basis, divisor},
};
use crate::recording::Defect;

pub(super) const CHECK: Check = Check {
    title: "Depth bias",
    unit: Unit::Mm,
    basis: Basis::Depth,
    tolerance: Tolerance::named("depth-bias", 3.0),
};

pub(super) fn check(case: &Case<'_>, known: &Known) -> Finding {
    let mut finding = Finding::new(Code::TD302, &case.tolerances);
    let tolerance_m = case.tolerances.of(finding.code);
    finding.show("0 mm", "—");
    let (found, focal) = match basis(case, known) {
        Ok(both) => both,
        Err(why) => {
            name_row(&mut finding, None);
            let claim = format!("Cannot tell whether depth has a bias: {why}.");
            return finding.unknown(claim, ToRecord::Distances);
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
                "At the mean of the recorded distances; followed down to 0 m it would be a guess",
            )
        } else if doubtful {
            (Verdict::Unknown, found.bias_m, "Where the line of sensor over board meets 0 m")
        } else {
            (by_bias, found.bias_m, "Where the line of sensor over board meets 0 m")
        };
    finding.verdict = verdict;
    finding.measured(deviation_m);
    finding.show("0 mm", format!("{} mm", value_and_sigma(in_mm(deviation_m), 2)));
    name_row(&mut finding, (deviation_m == offset_m).then_some(found.center_m));
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
    finding.claim = format!(
        "{words}: {} ± {:.2} mm, sensor minus board.",
        signed(1e3 * deviation_m.value, 2),
        1e3 * deviation_m.sigma,
    );
    finding.test = format!("{place}; {}.", finding.tolerance_words());
    match verdict {
        Verdict::Fault => {
            finding.what_to_do = format!(
                "Subtract {} mm from depth{}.",
                plain(1e3 * bias_m, 2),
                if divisor == 1.0 { "" } else { ", then divide it as TD301 says" }
            );
        }
        Verdict::Unknown | Verdict::Warning => finding.record(ToRecord::Distances),
        Verdict::Info | Verdict::Ok => {}
    }
    // Where the scale tells it all nothing is left.
    if bias_m.abs() > 1e-6 {
        finding.name_if_significant(Defect::DepthBias { bias_m });
    }
    finding
}

/// Says where the bias was measured, if not at 0 m.
fn name_row(finding: &mut Finding, center_m: Option<f64>) {
    if let Some(row) = &mut finding.quantity {
        row.name = match center_m {
            Some(center_m) => format!("Depth bias at {} m (sensor − board)", plain(center_m, 2)),
            None => "Depth bias (sensor − board)".to_owned(),
        };
    }
}
