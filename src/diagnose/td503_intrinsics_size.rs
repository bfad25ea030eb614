#![doc = include_str!("td503_intrinsics_size.md")]

use super::{
    Basis, Case, Check, Code, Evidence, Finding, Known, ToRecord, Tolerance, Unit, Verdict,
    numbers::signed,
};
use crate::{camera::Intrinsics, recording::Defect};

pub(super) const CHECK: Check = Check {
    title: "Size the intrinsics are for",
    unit: Unit::Percent,
    basis: Basis::Metadata,
    tolerance: Tolerance::fixed(100.0 * FARTHEST),
};

/// No phone's lens sits farther off the centre of its image than this, as a fraction of the image's size: decentring is
/// a percent or so, and image stabilisation moves the lens by less than two.
const FARTHEST: f64 = 0.10;

/// How far the principal point lies off the image's centre along the worse axis, as a fraction of its size.
fn off_center(case: &Case<'_>, k: &Intrinsics) -> f64 {
    // Images of another size than the depth map's would need intrinsics of their own.
    let [width, height] = case.size_px.unwrap_or([k.width, k.height]).map(|n| n as f64);
    let (x, y) = (k.cx / (width - 1.0) - 0.5, k.cy / (height - 1.0) - 0.5);
    if x.abs() > y.abs() { x } else { y }
}

/// What the intrinsics have to be multiplied by, where they are those of the reference dimensions.
fn factor(case: &Case<'_>) -> Option<[f64; 2]> {
    let factory = case.factory?;
    let mut k = factory.intrinsics;
    if off_center(case, &k).abs() <= FARTHEST {
        return None;
    }
    let [width, height] = case.size_px.unwrap_or([k.width, k.height]).map(|n| n as f64);
    let [x, y] = factory.reference_dimensions.map(|[w, h]| [width / w, height / h])?;
    (k.cx, k.cy) = (k.cx * x, k.cy * y);
    (off_center(case, &k).abs() <= FARTHEST).then_some([x, y])
}

/// The factory's intrinsics once this check's defect is out of them.
pub(super) fn scaled(case: &Case<'_>) -> Option<Intrinsics> {
    let k = case.factory?.intrinsics;
    let [x, y] = factor(case).unwrap_or([1.0; 2]);
    Some(Intrinsics { fx: k.fx * x, cx: k.cx * x, fy: k.fy * y, cy: k.cy * y, ..k })
}

pub(super) fn check(case: &Case<'_>, _: &Known) -> Finding {
    let mut finding = Finding::new(Code::TD503, &case.tolerances);
    let Some(factory) = case.factory else {
        let claim = "The recording has no factory intrinsics.".to_owned();
        return finding.unknown(claim, ToRecord::Metadata);
    };
    let k = factory.intrinsics;
    let [width, height] = case.size_px.unwrap_or([k.width, k.height]).map(|n| n as f64);
    let off = off_center(case, &k);
    finding.value = Some(100.0 * off);
    finding.evidence = vec![
        Evidence::number("factory_focal_px", k.focal_px()),
        Evidence::number("principal_x_px", k.cx),
        Evidence::number("principal_y_px", k.cy),
        Evidence::number("image_width_px", width),
        Evidence::number("image_height_px", height),
    ];
    if off.abs() <= FARTHEST {
        finding.verdict = Verdict::Ok;
        finding.claim = format!(
            "The intrinsics are those of the {width}x{height} image: the principal point ({:.1}, {:.1}) lies {} % \
             off its centre.",
            k.cx,
            k.cy,
            signed(100.0 * off, 1)
        );
        return finding;
    }
    finding.verdict = Verdict::Fault;
    finding.claim = format!(
        "The intrinsics are not those of the {width}x{height} image: the principal point ({:.1}, {:.1}) lies {} % \
         off its centre.",
        k.cx,
        k.cy,
        signed(100.0 * off, 0)
    );
    if let (Some(factor), Some([w, h])) = (factor(case), factory.reference_dimensions) {
        finding.what_to_do = format!(
            "Scale them: they are still at the reference dimensions {w}x{h}, as Apple delivers them."
        );
        finding.defect = Some(Defect::IntrinsicsScale { factor });
    } else {
        finding.what_to_do = "Find out for which size of image the intrinsics were meant; the image may also have been \
                              cropped or turned."
            .to_owned();
    }
    finding
}
