#![doc = include_str!("td402_shift.md")]

use super::{
    Basis, Case, Check, Code, Evidence, Finding, Known, ToRecord, Tolerance, Unit, Verdict,
    numbers::signed,
    td301_depth_scale::basis,
    td401_zoom::{by_what, witnesses},
};
use crate::{calibrate::Estimate, math, recording::Defect};

pub(super) const CHECK: Check = Check {
    title: "Depth-to-colour shift",
    unit: Unit::Px,
    basis: Basis::Depth,
    tolerance: Tolerance::named("shift", 1.0),
};

pub(super) fn check(case: &Case<'_>, known: &Known) -> Finding {
    let mut finding = Finding::new(Code::TD402, &case.tolerances);
    let tolerance_px = case.tolerances.of(finding.code);
    finding.show("0, 0 px", "—");
    let found = match basis(case, known) {
        Ok((found, _)) => found,
        Err(why) => {
            let claim = format!("Cannot tell whether depth is shifted against colour: {why}.");
            return finding.unknown(claim, ToRecord::Tilted);
        }
    };
    let [x, y] = found.shift_px;
    // The worse of both axes: a fault in one is a fault, and ok must mean both.
    finding.verdict = Verdict::of(x, tolerance_px).min(Verdict::of(y, tolerance_px));
    let length_px = math::hypot(x.value, y.value);
    finding.value = Some(length_px);
    finding.sigma = Some(sigma_along(&found.covariance, [x, y]));
    // With the σ of the difference in the next column; that of each axis stands in the evidence.
    let decimals = if x.sigma.max(y.sigma) < 0.95 { 2 } else { 1 };
    let cell = format!("{}, {} px", signed(x.value, decimals), signed(y.value, decimals));
    finding.show("0, 0 px", cell);
    finding.evidence = vec![
        Evidence::estimate("shift_x_px", x),
        Evidence::estimate("shift_y_px", y),
        Evidence::estimate("shift_x_by_slopes_px", found.slopes.shift_px[0]),
        Evidence::estimate("shift_y_by_slopes_px", found.slopes.shift_px[1]),
    ];
    if let Some(print) = &found.imprint {
        finding.evidence.push(Evidence::estimate("shift_x_by_print_px", print.shift_px[0]));
        finding.evidence.push(Evidence::estimate("shift_y_by_print_px", print.shift_px[1]));
    }
    finding.evidence.extend(witnesses(found));
    let words = match finding.verdict {
        Verdict::Fault => "Depth lies beside its colour",
        Verdict::Info => "Depth lies on its colour within the tolerance, if not exactly",
        Verdict::Ok => "Depth lies on its colour",
        Verdict::Unknown | Verdict::Warning => {
            "Cannot tell whether depth is shifted against colour"
        }
    };
    finding.claim = format!(
        "{words}: {} ± {:.2} px to the right, {} ± {:.2} px down.",
        signed(x.value, 2),
        x.sigma,
        signed(y.value, 2),
        y.sigma,
    );
    finding.test =
        format!("{}; either axis judged by itself; {}.", by_what(found), finding.tolerance_words());
    match finding.verdict {
        Verdict::Fault => {
            finding.what_to_do =
                "Shift the depth map back before depth is looked up at a colour pixel.".to_owned();
        }
        Verdict::Unknown | Verdict::Warning => finding.record(ToRecord::Tilted),
        Verdict::Info | Verdict::Ok => {}
    }
    finding.name_if_significant(Defect::DepthShift { shift_px: [x.value, y.value] });
    finding
}

/// Standard deviation of the shift along itself, pixels.
fn sigma_along(covariance: &[[f64; 5]; 5], [x, y]: [Estimate; 2]) -> f64 {
    let length = math::hypot(x.value, y.value);
    if !(length > 0.0) {
        return x.sigma.max(y.sigma);
    }
    let (a, b) = (x.value / length, y.value / length);
    let variance =
        a * a * covariance[3][3] + 2.0 * a * b * covariance[3][4] + b * b * covariance[4][4];
    variance.max(0.0).sqrt()
}
