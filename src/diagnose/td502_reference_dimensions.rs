#![doc = include_str!("td502_reference_dimensions.md")]

use super::{Case, Code, Evidence, Finding, Unit, Verdict};
use crate::recording::Factory;

/// Within one recording there is nothing to disagree with; the numbers are stated.
pub(super) fn check(case: &Case<'_>) -> Finding {
    let mut finding = Finding::new(Code::TD502, Unit::Percent);
    let Some([width, height]) = case.factory.and_then(|f| f.reference_dimensions) else {
        finding.verdict = Verdict::Info;
        finding.summary =
            "The recording does not tell the reference dimensions of its intrinsics.".to_owned();
        return finding;
    };
    finding.verdict = Verdict::Info;
    finding.evidence = vec![
        Evidence::number("reference_width_px", width),
        Evidence::number("reference_height_px", height),
    ];
    finding.summary = format!(
        "The intrinsics are given for images of {width:.0}x{height:.0} px. Whether the other API of this device says \
         the same takes a recording of each: `truedepth compare`."
    );
    finding
}

/// AVFoundation's metadata against ARKit's, of one device.
pub fn reference_dimensions(av_foundation: &Factory, ar_kit: &Factory) -> Finding {
    let mut finding = Finding::new(Code::TD502, Unit::Percent);
    let both = (av_foundation.reference_dimensions, ar_kit.reference_dimensions);
    let (Some([av_width, av_height]), Some([ar_width, ar_height])) = both else {
        finding.summary =
            "Cannot compare reference dimensions: one of the recordings does not tell them."
                .to_owned();
        finding.what_to_do =
            "Record with an app that saves intrinsicMatrixReferenceDimensions.".to_owned();
        return finding;
    };
    let percent = 100.0 * (ar_width / av_width - 1.0);
    let zoom = av_width / ar_width;
    // Intrinsics at the image's size, brought to the reference: the same lens has the same focal length there.
    let unscaled = |factory: &Factory, width: f64| {
        factory.intrinsics.fx * width / factory.intrinsics.width as f64
    };
    let focal_ratio = unscaled(ar_kit, ar_width) / unscaled(av_foundation, av_width);
    finding.value = Some(percent);
    finding.evidence = vec![
        Evidence::number("av_foundation_width_px", av_width),
        Evidence::number("av_foundation_height_px", av_height),
        Evidence::number("ar_kit_width_px", ar_width),
        Evidence::number("ar_kit_height_px", ar_height),
        Evidence::number("expected_zoom", zoom),
        Evidence::number("focal_ratio_at_reference", focal_ratio),
    ];
    let same = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-4;
    if same(av_width, ar_width) && same(av_height, ar_height) {
        finding.verdict = Verdict::Ok;
        finding.summary = format!(
            "Both APIs give their intrinsics for images of {av_width:.0}x{av_height:.0} px."
        );
    } else if same(focal_ratio, 1.0) {
        finding.verdict = Verdict::Warning;
        finding.summary = format!(
            "AVFoundation gives its intrinsics for {av_width:.0}x{av_height:.0} px, ARKit the same numbers for \
             {ar_width:.0}x{ar_height:.0} px ({percent:+.1} %): ARKit's depth is to be expected zoomed by {zoom:.4} \
             against its colour (TD401)."
        );
        finding.what_to_do =
            "Measure the zoom of the ARKit recording with a board (TD401), then resample \
                              its depth."
                .to_owned();
    } else {
        finding.verdict = Verdict::Warning;
        finding.summary = format!(
            "AVFoundation gives its intrinsics for {av_width:.0}x{av_height:.0} px, ARKit for \
             {ar_width:.0}x{ar_height:.0} px ({percent:+.1} %), and the focal lengths differ by {:+.1} %: one of them \
             is wrong (TD201).",
            100.0 * (focal_ratio - 1.0)
        );
        finding.what_to_do =
            "Calibrate with a board (TD201); do not trust either API's focal length until then."
                .to_owned();
    }
    finding
}
