#![doc = include_str!("td301_depth_scale.md")]

use super::{
    Basis, Case, Check, Code, Evidence, Finding, Known, ToRecord, Tolerance, Unit, Verdict,
    numbers::{signed, value_and_sigma},
    td201_focal_length::Measured,
};
use crate::{calibrate::Estimate, depth::Registration, math, recording::Defect};

pub(super) const CHECK: Check = Check {
    title: "Depth scale",
    unit: Unit::Percent,
    basis: Basis::Depth,
    tolerance: Tolerance::named("depth-scale", 1.0),
};

/// What the registration says once the focal length's whole uncertainty is in it: the board's depth is proportional to
/// the focal length, so that its relative sigma is one of the scale and of every offset, but none of the bias.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scaled {
    /// Scale minus one, from the slope over distance.
    pub(super) slope: Estimate,
    /// Sensor minus board at the nearest, the mean and the farthest distance, metres.
    pub(super) errors_m: [Estimate; 3],
    /// These distances, metres.
    pub(super) distances_m: [f64; 3],
}

impl Scaled {
    pub(super) fn new(found: &Registration, focal: &Measured) -> Self {
        // The registration knows the fit's own sigma already.
        let common = focal.relative_sigma_beyond_fit();
        let [near_m, far_m] = found.range_m;
        let distances_m = [near_m, found.center_m, far_m];
        Self {
            slope: Estimate {
                value: found.scale.value - 1.0,
                sigma: math::hypot(found.scale.sigma, common),
            },
            errors_m: distances_m.map(|distance_m| {
                let Estimate { value, sigma } = found.error_at_m(distance_m);
                Estimate { value, sigma: math::hypot(sigma, common * distance_m) }
            }),
            distances_m,
        }
    }

    /// Sensor minus board at the mean distance, metres.
    pub(super) fn offset_m(&self) -> Estimate {
        self.errors_m[1]
    }

    /// Sensor over board minus one at the nearest, the mean and the farthest distance.
    fn ratios(&self) -> [Estimate; 3] {
        [0, 1, 2].map(|i| {
            let Estimate { value, sigma } = self.errors_m[i];
            Estimate { value: value / self.distances_m[i], sigma: sigma / self.distances_m[i] }
        })
    }
}

/// The registration and the focal length, where both are fit to judge the sensor by; otherwise why not.
pub(super) fn basis<'a>(
    case: &Case<'a>,
    known: &'a Known,
) -> Result<(&'a Registration, &'a Measured), String> {
    if let Some(why) = case.poor_fit() {
        return Err(why);
    }
    let (Some(found), Some(focal)) = (case.registration, &known.focal) else {
        return Err(why_unknown(case));
    };
    if focal.own_camera_ignores_distortion() {
        return Err(format!(
            "the stream is distorted (TD203) and the own camera's focal length of {:.2} px makes up for that, so that \
             the board's depth is not to be relied on; a camera model with the distortion (method auto) can tell",
            focal.own_px
        ));
    }
    Ok((found, focal))
}

/// Why the sensor cannot be judged, with what was seen under the factory's focal length.
fn why_unknown(case: &Case<'_>) -> String {
    let mut why = if case.camera.is_none() {
        format!("the camera's own focal length is not known ({})", case.why_no_camera())
    } else if case.own_depth.is_none_or(|d| d.frames.iter().all(|f| f.samples.is_empty())) {
        "no frame has depth at the corners of the board".to_owned()
    } else {
        "too few frames have depth on the board".to_owned()
    };
    if let Some(mean) = case.factory_depth.and_then(|d| d.mean_of_medians_m) {
        why += &format!(
            "; with the factory's focal length the sensor is {:.2} mm too {}, but a wrong focal length would look just \
             so",
            1e3 * mean.value.abs(),
            if mean.value > 0.0 { "near" } else { "far" },
        );
    }
    why
}

/// Which measure of the scale decides, and what it says.
struct Judged {
    verdict: Verdict,
    deviation: Estimate,
    /// Of sensor to board, at the mean distance; else the slope.
    is_ratio: bool,
    how: &'static str,
    /// Sensor over truth, as it would be corrected.
    scale: f64,
}

fn judged(case: &Case<'_>, found: &Registration, scaled: &Scaled) -> Judged {
    let [_, ratio, _] = scaled.ratios();
    let judge = |deviation| Verdict::of(deviation, case.tolerances.of(Code::TD301));
    let somewhere = scaled.ratios().into_iter().any(|ratio| judge(ratio) == Verdict::Fault);
    let (verdict, is_ratio, how) = match judge(scaled.slope) {
        // The slope tells a scale from a bias. Where it is too uncertain, depth at the recorded distances still is true
        // or not, and a wrong scale could hide there only behind a bias that makes up for it.
        Verdict::Unknown => (
            judge(ratio),
            true,
            "Mean ratio of sensor to board; the slope over distance is too uncertain to decide",
        ),
        // A slope that a bias makes up for at every distance recorded has harmed nobody.
        Verdict::Fault if !somewhere => (
            judge(ratio),
            true,
            "Mean ratio of sensor to board; the slope over distance is steeper, but a bias makes up for it",
        ),
        verdict => (verdict, false, "Slope over distance, from all of the board's surface"),
    };
    let deviation = if is_ratio { ratio } else { scaled.slope };
    // Without a bias worth the name the mean ratio knows the scale best.
    let with_bias = found.bias_m.value.abs() > 3.0 * found.bias_m.sigma;
    let scale = 1.0 + if with_bias { deviation.value } else { ratio.value };
    Judged { verdict, deviation, is_ratio, how, scale }
}

/// What TD301 would have depth divided by; 1 where the scale is not significantly another.
pub(super) fn divisor(case: &Case<'_>, found: &Registration, scaled: &Scaled) -> f64 {
    let judged = judged(case, found, scaled);
    if matches!(judged.verdict, Verdict::Fault | Verdict::Info) { judged.scale } else { 1.0 }
}

pub(super) fn check(case: &Case<'_>, known: &Known) -> Finding {
    let mut finding = Finding::new(Code::TD301, &case.tolerances);
    finding.show("1", "—");
    let (found, focal) = match basis(case, known) {
        Ok(both) => both,
        Err(why) => {
            let claim = format!("Cannot tell whether depth has the right scale: {why}.");
            return finding.unknown(claim, ToRecord::Distances);
        }
    };
    let scaled = Scaled::new(found, focal);
    let [_, ratio, _] = scaled.ratios();
    let [near_m, _, far_m] = scaled.distances_m;
    let Judged { verdict, deviation, is_ratio, how, scale } = judged(case, found, &scaled);
    finding.verdict = verdict;
    finding.measured(deviation);
    // The deviation that was judged (a slope or a mean ratio), so that both columns tell the same.
    let shown = Estimate { value: 1.0 + deviation.value, sigma: deviation.sigma };
    finding.show("1", value_and_sigma(shown, 4));
    if let (Some(row), true) = (&mut finding.quantity, is_ratio) {
        row.name += " (mean ratio)";
    }
    finding.evidence = vec![
        Evidence::estimate("scale", found.scale),
        Evidence::estimate(
            "ratio_at_center",
            Estimate { value: 1.0 + ratio.value, sigma: ratio.sigma },
        ),
        Evidence::number("relative_sigma_of_focal", focal.relative_sigma()),
        Evidence::number("nearest_m", near_m),
        Evidence::number("farthest_m", far_m),
        Evidence::number("n_patches", found.n_patches as f64),
        Evidence::number("n_frames", found.n_frames as f64),
    ];
    let words = match verdict {
        Verdict::Fault if deviation.value > 0.0 => "Depth is too long",
        Verdict::Fault => "Depth is too short",
        Verdict::Info => "Depth has the right scale within the tolerance, if not exactly",
        Verdict::Ok => "Depth has the right scale",
        Verdict::Unknown | Verdict::Warning => "Cannot tell whether depth has the right scale",
    };
    finding.claim = format!(
        "{words}: {} ± {:.2} % between {near_m:.2} m and {far_m:.2} m.",
        signed(100.0 * deviation.value, 2),
        100.0 * deviation.sigma,
    );
    finding.test = format!(
        "{how}; σ includes {:.2} % of the focal length; {} samples in {} frames; {}.",
        100.0 * focal.relative_sigma(),
        found.n_patches,
        found.n_frames,
        finding.tolerance_words(),
    );
    match verdict {
        Verdict::Fault => {
            finding.what_to_do = format!(
                "Divide depth by {scale:.4}. Make sure first that the board's squares really measure {:.3} mm: a board \
                 printed at another scale looks just so.",
                1e3 * case.board.square_m
            );
        }
        Verdict::Unknown | Verdict::Warning => finding.record(ToRecord::Distances),
        Verdict::Info | Verdict::Ok => {}
    }
    finding.name_if_significant(Defect::DepthScale { ratio: scale });
    finding
}
