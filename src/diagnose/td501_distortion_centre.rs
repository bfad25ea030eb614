#![doc = include_str!("td501_distortion_centre.md")]

use super::{Basis, Case, Check, Code, Evidence, Finding, Known, Unit, Verdict, numbers::signed};
use crate::math;

pub(super) const CHECK: Check = Check {
    title: "Principal point and distortion centre",
    unit: Unit::Px,
    basis: Basis::Metadata,
    tolerance: None,
};

/// Both are given to a hundredth of a pixel at best; nearer than that they are one place.
const SAME_PX: f64 = 0.01;

pub(super) fn check(case: &Case<'_>, _: &Known) -> Finding {
    let mut finding = Finding::new(Code::TD501, &case.tolerances);
    let Some((intrinsics, center)) =
        case.factory.and_then(|f| Some((f.intrinsics, f.distortion_center?)))
    else {
        finding.claim = "The recording does not tell the lens distortion centre.".to_owned();
        finding.what_to_do =
            "Nothing, unless lookup tables are to be applied: they need the centre.".to_owned();
        return finding;
    };
    let (dx, dy) = (center.x - intrinsics.cx, center.y - intrinsics.cy);
    let distance_px = math::hypot(dx, dy);
    finding.value = Some(distance_px);
    finding.evidence = vec![
        Evidence::number("center_minus_principal_x_px", dx),
        Evidence::number("center_minus_principal_y_px", dy),
    ];
    if distance_px <= SAME_PX {
        finding.verdict = Verdict::Ok;
        finding.claim = "Principal point and lens distortion centre are one place.".to_owned();
    } else {
        finding.verdict = Verdict::Info;
        finding.claim = format!(
            "Principal point and lens distortion centre lie {distance_px:.2} px apart ({}, {}), as on \
             iPads with the ultra-wide front camera.",
            signed(dx, 2),
            signed(dy, 2)
        );
        finding.what_to_do =
            "Use the distortion centre with the lookup tables, and the principal point with the \
                              focal length."
                .to_owned();
    }
    finding
}
