#![doc = include_str!("td401_zoom.md")]

use super::{
    Basis, Case, Check, Code, Evidence, Finding, Known, ToRecord, Tolerance, Unit, Verdict,
    numbers::value_and_sigma, td301_depth_scale::basis,
};
use crate::{calibrate::Estimate, depth::Registration, recording::Defect};

pub(super) const CHECK: Check = Check {
    title: "Depth-to-colour zoom",
    unit: Unit::Percent,
    basis: Basis::Depth,
    tolerance: Tolerance::named("zoom", 1.0),
};

pub(super) fn check(case: &Case<'_>, known: &Known) -> Finding {
    let mut finding = Finding::new(Code::TD401, &case.tolerances);
    finding.show("1", "—");
    let found = match basis(case, known) {
        Ok((found, _)) => found,
        Err(why) => {
            let claim = format!("Cannot tell whether depth is zoomed against colour: {why}.");
            return finding.unknown(claim, ToRecord::Tilted);
        }
    };
    let zoom = found.zoom;
    let deviation = Estimate { value: zoom.value - 1.0, sigma: zoom.sigma };
    finding.verdict = Verdict::of(deviation, case.tolerances.of(finding.code));
    finding.measured(deviation);
    finding.show("1", value_and_sigma(zoom, 4));
    finding.evidence = vec![
        Evidence::estimate("zoom", zoom),
        Evidence::estimate("zoom_by_slopes", found.slopes.zoom),
    ];
    if let Some(print) = &found.imprint {
        finding.evidence.push(Evidence::estimate("zoom_by_print", print.zoom));
    }
    finding.evidence.extend(witnesses(found));
    let words = match finding.verdict {
        Verdict::Fault if deviation.value < 0.0 => {
            "The depth map shows only the middle of the colour image"
        }
        Verdict::Fault => "The depth map shows more than the colour image",
        Verdict::Info => "Depth and colour have the same zoom within the tolerance, if not exactly",
        Verdict::Ok => "Depth and colour have the same zoom",
        Verdict::Unknown | Verdict::Warning => "Cannot tell whether depth is zoomed against colour",
    };
    finding.claim = format!(
        "{words}: {:.4} ± {:.4} of its width about the principal point.",
        zoom.value, zoom.sigma,
    );
    finding.test = format!("{}; {}.", by_what(found), finding.tolerance_words());
    match finding.verdict {
        Verdict::Fault => {
            finding.what_to_do = format!(
                "Resample the depth map: the full depth image belongs on a rectangle of {:.4} times the colour image's \
                 width and height, centred at the principal point. Until then depth lies up to {:.0} px beside its \
                 colour.",
                zoom.value,
                edge_px(case, deviation.value)
            );
        }
        Verdict::Unknown | Verdict::Warning => finding.record(ToRecord::Tilted),
        Verdict::Info | Verdict::Ok => {}
    }
    finding.name_if_significant(Defect::DepthZoom { zoom: [zoom.value; 2] });
    finding
}

/// What zoom and shift rest on, for the beginning of a test.
pub(super) fn by_what(found: &Registration) -> String {
    let slopes = format!(
        "From the slopes of tilted views, {} patches in {} frames",
        found.n_patches, found.n_frames
    );
    match &found.imprint {
        Some(print) => format!(
            "{slopes}, and from the print, which the depth maps of {} frames show by {:.2} mm",
            print.n_frames,
            1e3 * print.contrast_m.value.abs()
        ),
        None => slopes,
    }
}

/// The same as numbers.
pub(super) fn witnesses(found: &Registration) -> Vec<Evidence> {
    let mut numbers = vec![
        Evidence::number("n_frames", found.n_frames as f64),
        Evidence::number("n_patches", found.n_patches as f64),
    ];
    if let Some((print, disagreement)) = found.imprint.as_ref().zip(found.disagreement) {
        numbers.push(Evidence::estimate("print_contrast_m", print.contrast_m));
        numbers.push(Evidence::number("disagreement", disagreement));
    }
    numbers
}

/// How far the zoom moves the image's edge, pixels.
fn edge_px(case: &Case<'_>, deviation: f64) -> f64 {
    let half = case.size_px.map_or(320.0, |[width, _]| 0.5 * width as f64);
    (deviation * half).abs()
}
