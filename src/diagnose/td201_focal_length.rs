#![doc = include_str!("td201_focal_length.md")]

use super::{
    Basis, Case, Check, Code, Evidence, Finding, Known, ToRecord, Tolerance, Unit, Verdict,
    numbers::{plain, signed, value_and_sigma},
    td503_intrinsics_size,
};
use crate::{
    calibrate::{Estimate, KnownCamera, Lens},
    camera::Distortion,
    recording::{Defect, StreamState},
};

pub(super) const CHECK: Check = Check {
    title: "Focal length",
    unit: Unit::Percent,
    basis: Basis::Views,
    tolerance: Tolerance::named("focal", 1.0),
};

/// The focal length that this recording speaks for, with everything that makes it unsure.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measured {
    /// Comparable with the factory's: lens distortion taken out.
    pub(super) focal_px: Estimate,
    /// As the own camera has it.
    pub(super) own_px: f64,
    /// Where it comes from.
    origin: Origin,
    /// From the fit's own covariance.
    formal_sigma_px: Option<f64>,
    /// Half the difference of both halves of the views.
    split_half_sigma_px: Option<f64>,
    /// The least and the greatest without any one picture, pixels; of the own camera's focal length alone.
    left_out_px: Option<[f64; 2]>,
}

impl Measured {
    /// Standard deviation of the focal length as a fraction of it: every depth of the board carries it.
    pub(super) fn relative_sigma(&self) -> f64 {
        self.focal_px.sigma / self.focal_px.value
    }

    /// What [`relative_sigma`](Self::relative_sigma) has beyond the fit's own sigma.
    pub(super) fn relative_sigma_beyond_fit(&self) -> f64 {
        let of_fit = self.formal_sigma_px.unwrap_or(0.0) / self.focal_px.value;
        (self.relative_sigma().powi(2) - of_fit.powi(2)).max(0.0).sqrt()
    }

    /// True where the own camera's focal length makes up for a distortion it does not know.
    pub(super) fn own_camera_ignores_distortion(&self) -> bool {
        self.origin == Origin::DistortionTakenOut
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Origin {
    /// The own camera's, straight.
    Own,
    /// The own camera knows no distortion, the stream has some.
    DistortionTakenOut,
    /// Given from outside.
    Given,
}

pub(super) fn measure(case: &Case<'_>, state: StreamState) -> Option<Measured> {
    let camera = case.camera?;
    let own_px = camera.intrinsics.focal_px();
    // Each half has √2 the sigma of the whole, their difference twice: half of it is one draw of the whole's error.
    let half_of = |[a, b]: [f64; 2]| (a - b).abs() / 2.0;
    let Some(calibration) = case.calibration else {
        let focal = |given: &KnownCamera| {
            given.parameters.iter().find(|p| p.name == "focal_px").map(|p| p.estimate.sigma)
        };
        // The fit's own number is the horizontal focal length.
        let formal = case.given.and_then(focal).map(|sigma| sigma * own_px / camera.intrinsics.fx);
        let split_half = case.given.and_then(|given| given.split_half_focal_px).map(half_of);
        // Nothing known of its errors: taken as exact.
        let sigma = formal.map_or(0.0, |formal| formal.max(split_half.unwrap_or(0.0)));
        return Some(Measured {
            focal_px: Estimate { value: own_px, sigma },
            own_px,
            origin: Origin::Given,
            formal_sigma_px: formal,
            split_half_sigma_px: split_half.filter(|_| formal.is_some()),
            left_out_px: None,
        });
    };
    let formal = calibration.parameter("focal_px").map(|f| f.sigma);
    let halves = calibration.split_half_focal_px.map(|halves| halves.map(|half| half.value));
    let split_half = halves.map(half_of);
    let bent = state == StreamState::Distorted && camera.distortion == Distortion::None;
    let straightened = || {
        let hypotheses = &case.distortion?.hypotheses;
        let under = |lens: Lens| hypotheses.iter().find(|h| h.lens == lens).map(|h| h.focal_px);
        under(Lens::InverseTable).or_else(|| under(Lens::FreeRadial))
    };
    let (value, formal, origin) = match bent.then(straightened).flatten() {
        Some(under) => (under.value, Some(under.sigma), Origin::DistortionTakenOut),
        None => (own_px, formal, Origin::Own),
    };
    let without =
        calibration.left_out.iter().map(|picture| picture.focal_px * own_px / camera.intrinsics.fx);
    let left_out_px = (origin == Origin::Own && !calibration.left_out.is_empty()).then(|| {
        [without.clone().fold(f64::INFINITY, f64::min), without.fold(f64::NEG_INFINITY, f64::max)]
    });
    // The worse of both: halves see errors that vary over the recording. With neither nothing is known.
    let sigma = [formal, split_half].into_iter().flatten().fold(f64::NAN, f64::max);
    Some(Measured {
        focal_px: Estimate { value, sigma },
        own_px,
        origin,
        formal_sigma_px: formal,
        split_half_sigma_px: split_half,
        left_out_px,
    })
}

pub(super) fn check(case: &Case<'_>, known: &Known) -> Finding {
    let mut finding = Finding::new(Code::TD201, &case.tolerances);
    let factory_px = case.factory.map(|f| f.intrinsics.focal_px());
    let cell = |px: Option<String>| px.map_or_else(|| "—".to_owned(), |px| format!("{px} px"));
    let factory_cell = cell(factory_px.map(|px| plain(px, 2)));
    let why = match (case.poor_fit(), factory_px) {
        (Some(why), _) => Some(why),
        (None, None) => Some("the recording has no factory intrinsics".to_owned()),
        (None, Some(_)) => known.focal.is_none().then(|| case.why_no_camera()),
    };
    let (Some(measured), Some(factory_px), None) = (&known.focal, factory_px, &why) else {
        // As it was calibrated or given, if not judged.
        let sigma_px = case.calibration.and_then(|c| c.parameter("focal_px")).map(|f| f.sigma);
        let own = case.camera.map(|camera| Estimate {
            value: camera.intrinsics.focal_px(),
            sigma: sigma_px.unwrap_or(f64::NAN),
        });
        finding.show(factory_cell, cell(own.map(|own| value_and_sigma(own, 2))));
        let why = why.unwrap_or_default();
        let claim = format!("Cannot tell whether the factory's focal length is right: {why}.");
        return finding.unknown(claim, ToRecord::ManySides);
    };
    let Estimate { value: focal_px, sigma: sigma_px } = measured.focal_px;
    let difference = Estimate { value: focal_px / factory_px - 1.0, sigma: sigma_px / factory_px };
    finding.verdict = Verdict::of(difference, case.tolerances.of(finding.code));
    finding.measured(difference);
    let percent = 100.0 * difference.value;
    let is_exact = measured.origin == Origin::Given && measured.formal_sigma_px.is_none();
    finding.sigma = finding.sigma.filter(|_| !is_exact);
    let percent_sigma = finding.sigma.unwrap_or(f64::NAN);
    let shown = Estimate { sigma: if is_exact { f64::NAN } else { sigma_px }, ..measured.focal_px };
    finding.show(factory_cell, cell(Some(value_and_sigma(shown, 2))));
    finding.evidence = vec![
        Evidence::number("factory_focal_px", factory_px),
        Evidence {
            sigma: finding.sigma.map(|_| sigma_px),
            ..Evidence::number("focal_px", focal_px)
        },
    ];
    for (name, value) in [
        ("sigma_of_fit_px", measured.formal_sigma_px),
        ("sigma_from_halves_px", measured.split_half_sigma_px),
        ("least_without_a_picture_px", measured.left_out_px.map(|[low, _]| low)),
        ("most_without_a_picture_px", measured.left_out_px.map(|[_, high]| high)),
    ] {
        finding.evidence.extend(value.map(|value| Evidence::number(name, value)));
    }
    let how = match measured.origin {
        Origin::Given if is_exact => "Given from outside and taken as exact".to_owned(),
        Origin::Given => format!("Given from outside, σ {}", measured.sigmas()),
        Origin::Own => {
            let without = measured.left_out_px.map_or(String::new(), |[low, high]| {
                format!("; without any one picture {low:.2} to {high:.2} px")
            });
            format!("Measured against the board, σ {}{without}", measured.sigmas())
        }
        Origin::DistortionTakenOut => {
            finding
                .evidence
                .push(Evidence::number("focal_with_distortion_left_in_px", measured.own_px));
            format!(
                "Measured with the stream's distortion taken out ({:.2} px with it left in), σ {}",
                measured.own_px,
                measured.sigmas()
            )
        }
    };
    // A σ that two decimals would call nothing has three.
    let decimals = if percent_sigma < 0.01 { 3 } else { 2 };
    let (decimals, spread) = if is_exact {
        (2, String::new())
    } else if percent_sigma < 5e-4 {
        (decimals, " ± less than 0.001".to_owned())
    } else {
        (decimals, format!(" ± {percent_sigma:.decimals$}"))
    };
    let words = match finding.verdict {
        Verdict::Fault => "The factory's focal length is wrong",
        Verdict::Info => "The factory's focal length is right within the tolerance, if not exactly",
        Verdict::Ok => "The factory's focal length is right",
        Verdict::Unknown | Verdict::Warning => {
            "Cannot tell whether the factory's focal length is right"
        }
    };
    finding.claim = format!(
        "{words}: {focal_px:.2} px instead of {factory_px:.2} px, {}{spread} %.",
        signed(percent, decimals)
    );
    finding.test = format!("{how}; {}.", finding.tolerance_words());
    match finding.verdict {
        Verdict::Fault => {
            finding.what_to_do = format!(
                "Use {focal_px:.2} px. With the factory's value every point cloud is {} sideways by {:.1} %, and a \
                 pose found from the image lies {} by as much.",
                if difference.value < 0.0 { "too small" } else { "too large" },
                percent.abs(),
                if difference.value < 0.0 { "too far" } else { "too near" },
            );
        }
        Verdict::Unknown | Verdict::Warning => finding.record(ToRecord::ManySides),
        Verdict::Info | Verdict::Ok => {}
    }
    let scaled_px = td503_intrinsics_size::scaled(case).map_or(factory_px, |k| k.focal_px());
    finding.name_if_significant(Defect::Focal { ratio: scaled_px / focal_px });
    finding
}

impl Measured {
    fn sigmas(&self) -> String {
        let known = |sigma: Option<f64>| sigma.map(|sigma| format!("{sigma:.2} px"));
        match (known(self.formal_sigma_px), known(self.split_half_sigma_px)) {
            (Some(fit), Some(halves)) => {
                format!(
                    "the larger of the fit's own {fit}, half the difference of both halves {halves}"
                )
            }
            (Some(fit), None) => format!("the fit's own {fit}; no two halves to compare"),
            (None, Some(halves)) => format!("half the difference of both halves {halves}"),
            (None, None) => "not known".to_owned(),
        }
    }
}
