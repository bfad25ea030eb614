#![doc = include_str!("td502_reference_dimensions.md")]

use super::{
    AcrossApis, Api, Basis, Case, Check, Code, Evidence, Finding, Known, KnownIssue, Sheet,
    Tolerances, Unit, Verdict, numbers::signed,
};

pub(super) const CHECK: Check = Check {
    title: "Reference dimensions",
    unit: Unit::Percent,
    basis: Basis::Metadata,
    tolerance: None,
};

/// Within one recording there is nothing to disagree with; the numbers are stated.
pub(super) fn check(case: &Case<'_>, _: &Known) -> Finding {
    let mut finding = Finding::new(Code::TD502, &case.tolerances);
    let Some([width, height]) = case.factory.and_then(|f| f.reference_dimensions) else {
        finding.verdict = Verdict::Info;
        finding.claim =
            "The recording does not tell the reference dimensions of its intrinsics.".to_owned();
        return finding;
    };
    finding.verdict = Verdict::Info;
    finding.evidence = vec![
        Evidence::number("reference_width_px", width),
        Evidence::number("reference_height_px", height),
    ];
    finding.claim = format!(
        "The intrinsics are given for images of {width:.0}x{height:.0} px. Whether the other API of this device says \
         the same takes a recording of each: `truedepth compare`."
    );
    finding
}

/// AVFoundation's parameters against ARKit's, of one device, and which correction the pair calls for.
pub(super) fn between(av: &Sheet, ar: &Sheet, across: &AcrossApis) -> Finding {
    let mut finding = Finding::new(Code::TD502, &Tolerances::default());
    let percent = 100.0 * across.reference_difference[0];
    finding.value = Some(percent);
    finding.evidence = vec![
        Evidence::number("av_reference_width_px", av.reference[0]),
        Evidence::number("ar_reference_width_px", ar.reference[0]),
        Evidence::number("av_focal_px", av.focal_px),
        Evidence::number("ar_focal_px", ar.focal_px),
    ];
    let dimensions = |sheet: &Sheet| format!("{}x{}", sheet.reference[0], sheet.reference[1]);
    let numbers = format!(
        "AVFoundation's reference dimensions are {}, ARKit's {} ({} %); depth focal lengths {:.2} and \
         {:.2} px ({} %)",
        dimensions(av),
        dimensions(ar),
        signed(percent, 1),
        av.focal_px,
        ar.focal_px,
        signed(100.0 * across.focal_difference, 1)
    );
    match across.issue {
        Some(KnownIssue::DepthZoom) => {
            finding.verdict = Verdict::Warning;
            let zoom = across.depth_zoom[0];
            finding.claim = format!(
                "{numbers}: one camera, two reference dimensions. Under ARKit depth appears zoomed against colour \
                 (issue 1 of the paper)."
            );
            finding.what_to_do = format!(
                "Zoom ARKit's depth maps by {zoom:.4} about the principal point: `truedepth correct REC \
                 --fault depth-zoom={zoom:.4}`. AVFoundation's are aligned."
            );
        }
        Some(_) => {
            finding.verdict = Verdict::Warning;
            let vga_px = across.av_corrected_px * 640.0 / av.reference[0];
            finding.claim = format!(
                "{numbers}: neither focal length is the camera's (issue 2 of the paper). Corrected by the paper's \
                 equations they are {:.2} px and {:.2} px, at 640 pixels {vga_px:.2} px and {:.2} px.",
                across.av_corrected_px,
                across.ar_corrected_px,
                across.ar_corrected_px * 640.0 / ar.reference[0],
            );
            finding.what_to_do =
                "Calibrate (`truedepth audit`), which is better than the equations; they are for \
                                  devices that cannot be calibrated any more."
                    .to_owned();
            finding.defect = across.defect(Api::AvFoundation);
        }
        None => {
            finding.verdict = Verdict::Ok;
            finding.claim = format!("{numbers}: both APIs say the same.");
        }
    }
    finding
}
