#![doc = include_str!("td503_intrinsics_size.md")]

use super::{Case, Code, Correction, Evidence, Finding, Unit, Verdict};

/// No phone's lens sits farther off the centre of its image than this, as a fraction of the image's size: decentring is
/// a percent or so, and image stabilisation moves the lens by less than two.
const FARTHEST: f64 = 0.10;

pub(super) fn check(case: &Case<'_>) -> Finding {
    let mut finding = Finding::new(Code::TD503, Unit::Percent);
    finding.tolerance = Some(100.0 * FARTHEST);
    let Some(factory) = case.factory else {
        finding.summary = "The recording has no factory intrinsics.".to_owned();
        finding.what_to_do = "Record with an app that saves the intrinsics.".to_owned();
        return finding;
    };
    let k = factory.intrinsics;
    // Images of another size than the depth map's would need intrinsics of their own.
    let [width, height] = case.size_px.unwrap_or([k.width, k.height]).map(|n| n as f64);
    let off_center = |cx: f64, cy: f64| {
        let (x, y) = (cx / (width - 1.0) - 0.5, cy / (height - 1.0) - 0.5);
        if x.abs() > y.abs() { x } else { y }
    };
    let off = off_center(k.cx, k.cy);
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
        finding.summary = format!(
            "The intrinsics are those of the {width}x{height} image: the principal point ({:.1}, {:.1}) lies {:+.1} % \
             off its centre.",
            k.cx,
            k.cy,
            100.0 * off
        );
        return finding;
    }
    finding.verdict = Verdict::Fault;
    let scaled = factory.reference_dimensions.map(|[w, h]| [width / w, height / h]);
    let fits = scaled.filter(|[x, y]| off_center(k.cx * x, k.cy * y).abs() <= FARTHEST);
    finding.summary = format!(
        "The intrinsics are not those of the {width}x{height} image: the principal point ({:.1}, {:.1}) lies {:+.0} % \
         off its centre.",
        k.cx,
        k.cy,
        100.0 * off
    );
    if let (Some(factor), Some([w, h])) = (fits, factory.reference_dimensions) {
        finding.what_to_do = format!(
            "Scale them: they are still at the reference dimensions {w}x{h}, as Apple delivers them."
        );
        finding.correction = Some(Correction::ScaleIntrinsics { factor });
    } else {
        finding.what_to_do = "Find out for which size of image the intrinsics were meant; the image may also have been \
                              cropped or turned."
            .to_owned();
    }
    finding
}
