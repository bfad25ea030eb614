#![doc = include_str!("td203_not_rectified.md")]

use super::{
    Basis, Case, Check, Code, Evidence, Finding, Known, ToRecord, Tolerance, Unit, Verdict,
    depth_state,
    numbers::{plain, signed},
};
use crate::{
    calibrate::{DistortionTest, Estimate, Lens},
    recording::{Defect, StreamState},
};

pub(super) const CHECK: Check = Check {
    title: "Lens distortion in the images",
    unit: Unit::Px,
    basis: Basis::Views,
    tolerance: Tolerance::named("distortion", 1.0),
};

/// A table is in the stream, is not, or was applied twice: halfway to the next of these it stops being one.
const HALFWAY: f64 = 0.5;

/// Which of the three the stream is, at 3 sigma.
pub(super) fn state(case: &Case<'_>) -> StreamState {
    let Some(test) = case.distortion.filter(|_| case.poor_fit().is_none()) else {
        return StreamState::Unknown;
    };
    let tolerance_px = case.tolerances.of(Code::TD203);
    match test.amplitude {
        Some(Estimate { value, sigma }) => {
            let reach = 3.0 * sigma;
            if value - reach > HALFWAY {
                StreamState::Distorted
            } else if value + reach < -HALFWAY {
                StreamState::RectifiedTwice
            } else if value + reach < HALFWAY && value - reach > -HALFWAY {
                StreamState::Rectified
            } else {
                StreamState::Unknown
            }
        }
        // Without a table a displacement is all there is to judge by, and which way it goes is the lens' own affair.
        None => match Verdict::of(test.corner_shift_px, tolerance_px) {
            Verdict::Fault => StreamState::Distorted,
            Verdict::Ok | Verdict::Info => StreamState::Rectified,
            Verdict::Unknown | Verdict::Warning => StreamState::Unknown,
        },
    }
}

/// What the file says, for the end of a summary; and whether it contradicts the pixels.
fn claim(case: &Case<'_>, state: StreamState) -> (&'static str, bool) {
    let flag = case.factory.and_then(|f| f.geometric_distortion_correction);
    match (flag, state) {
        (Some(true), StreamState::Distorted) => {
            (" The file says that Apple's correction was on, and is wrong.", true)
        }
        (Some(false), StreamState::Rectified) => (
            " The file says that Apple's correction was off, and is wrong or means another stream.",
            true,
        ),
        (Some(true), _) => (" The file says that Apple's correction was on.", false),
        (Some(false), _) => (" The file says that Apple's correction was off.", false),
        (None, _) => ("", false),
    }
}

/// RMS under a hypothesis, pixels.
fn rms_px(test: &DistortionTest, lens: Lens) -> Option<f64> {
    test.hypotheses.iter().find(|h| h.lens == lens).map(|h| h.rms_px)
}

/// The numbers of the test, for both findings about it.
pub(super) fn evidence(test: &DistortionTest) -> Vec<Evidence> {
    let mut evidence = vec![Evidence::estimate("corner_shift_px", test.corner_shift_px)];
    for (name, lens) in [
        ("rms_as_rectified_px", Lens::None),
        ("rms_with_inverse_table_px", Lens::InverseTable),
        ("rms_with_forward_table_px", Lens::ForwardTable),
        ("rms_with_free_share_of_table_px", Lens::FreeTable),
        ("rms_with_free_distortion_px", Lens::FreeRadial),
    ] {
        evidence.extend(rms_px(test, lens).map(|rms| Evidence::number(name, rms)));
    }
    evidence.extend(test.amplitude.map(|a| Evidence::estimate("table_amount", a)));
    evidence.extend(test.table_corner_shift_px.map(|t| Evidence::number("table_at_corner_px", t)));
    evidence.push(Evidence::estimate("k1", test.k1));
    evidence
}

/// The numbers in words.
pub(super) fn numbers(test: &DistortionTest) -> String {
    let Estimate { value, sigma } = test.corner_shift_px;
    let rms = |lens| rms_px(test, lens).unwrap_or(f64::NAN);
    match test.amplitude {
        Some(amount) => format!(
            "{} % ± {:.0} % of the distortion in Apple's table is in the images, {} ± {sigma:.2} px at the image's \
             corner; residuals are {:.2} px taken as rectified, {:.2} px with the inverse table and {:.2} px with the \
             forward table",
            plain(100.0 * amount.value, 0),
            100.0 * amount.sigma,
            signed(value, 2),
            rms(Lens::None),
            rms(Lens::InverseTable),
            rms(Lens::ForwardTable),
        ),
        None => format!(
            "the corners ask for a lens distortion of {} ± {sigma:.2} px at the image's corner (k1 = {} ± {:.3}); \
             residuals are {:.2} px without and {:.2} px with it. The recording has no table to compare with",
            signed(value, 2),
            signed(test.k1.value, 3),
            test.k1.sigma,
            rms(Lens::None),
            rms(Lens::FreeRadial),
        ),
    }
}

/// What the depth map's slopes and its print say of its own state, for the end of a summary.
fn of_depth(state: StreamState, depth: StreamState, share: Option<Estimate>) -> String {
    let Some(Estimate { value, sigma }) = share else { return String::new() };
    let how = match depth {
        StreamState::Unknown => "Whether depth is, too, this recording does not tell",
        same if same == state => "Depth is, too",
        _ => "Depth is not as colour is",
    };
    format!(
        " {how} (0 % is colour's state, 100 % the other one: {} % ± {:.0} %).",
        plain(100.0 * value, 0),
        100.0 * sigma
    )
}

/// Why nothing can be told, for the end of a sentence.
pub(super) fn why_unknown(case: &Case<'_>) -> String {
    case.poor_fit().unwrap_or_else(|| match case.camera {
        None => case.why_no_camera(),
        Some(_) => "the views do not determine a distortion".to_owned(),
    })
}

pub(super) fn check(case: &Case<'_>, known: &Known) -> Finding {
    let mut finding = Finding::new(Code::TD203, &case.tolerances);
    let state = known.state;
    let share = case.registration.and_then(|r| r.lens_share);
    let depth = depth_state(state, share);
    let of_depth_too = match depth {
        StreamState::Unknown => String::new(),
        same if same == state => ", depth too".to_owned(),
        other => format!(", depth {}", other.name()),
    };
    finding.show("—", state.name().replace('_', " ") + &of_depth_too);
    let (claim, contradicted) = claim(case, state);
    let Some(test) = case.distortion.filter(|_| case.poor_fit().is_none()) else {
        let claim =
            format!("Cannot tell whether the stream is rectified: {}.{claim}", why_unknown(case));
        return finding.unknown(claim, ToRecord::Corners);
    };
    let shift = test.corner_shift_px;
    let by_size = Verdict::of(shift, case.tolerances.of(Code::TD203));
    finding.measured(shift);
    finding.evidence = evidence(test);
    let (verdict, words, remainder) = match state {
        // A table of less than the tolerance harms nobody.
        StreamState::Distorted if by_size == Verdict::Fault => {
            (Verdict::Fault, "The stream is not rectified", "")
        }
        StreamState::Distorted => (Verdict::Info, "The stream is not rectified", ""),
        StreamState::RectifiedTwice => {
            (Verdict::Info, "The stream is bent the other way (TD204)", "")
        }
        // Not the table's doing, and perhaps the board's: a fact, but no state of the stream that could be undone.
        StreamState::Rectified if by_size == Verdict::Fault => (
            Verdict::Warning,
            "The stream is rectified",
            ". What remains is more than the tolerance",
        ),
        StreamState::Rectified if by_size == Verdict::Unknown => (
            Verdict::Info,
            "The stream is rectified",
            ". A remainder of more than the tolerance is not excluded",
        ),
        StreamState::Rectified if contradicted => (Verdict::Info, "The stream is rectified", ""),
        StreamState::Rectified => (by_size, "The stream is rectified", ""),
        StreamState::Unknown => {
            (Verdict::Unknown, "Cannot tell whether the stream is rectified", "")
        }
    };
    finding.verdict = verdict;
    finding.evidence.extend(share.map(|s| Evidence::estimate("depth_share_of_other_state", s)));
    finding.claim =
        format!("{words}: {}{remainder}.{claim}{}", numbers(test), of_depth(state, depth, share));
    if depth != StreamState::Unknown && depth != state {
        finding.verdict = Verdict::Warning;
        finding.what_to_do = format!(
            "Colour is {}, depth is {}: find out what has resampled one of them alone, and record again without it. No \
             single correction of both makes them agree.",
            state.name(),
            depth.name()
        );
        return finding;
    }
    match state {
        StreamState::Distorted => {
            finding.what_to_do = if case.factory.is_some_and(|f| f.tables.is_some()) {
                "Take corners and pixels through the inverse table before a pinhole is assumed, or resample colour and \
                 depth with the forward table. Apple distorts depth just as colour: every point off the axis lies \
                 sideways of where the pinhole puts it."
            } else {
                "Use the distortion of the own calibration, or record with an app that saves Apple's lookup tables. \
                 Apple distorts depth just as colour."
            }
            .to_owned();
            finding.defect = Some(Defect::Distorted);
        }
        StreamState::Rectified if shift.value.abs() > 3.0 * shift.sigma => {
            finding.what_to_do =
                "Nothing; do not apply the lookup tables to this stream.".to_owned();
        }
        StreamState::Rectified | StreamState::RectifiedTwice => {}
        StreamState::Unknown => finding.record(ToRecord::Corners),
    }
    finding
}
