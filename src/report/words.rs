//! Words and numbers as people read them; terminal and page say the same.

pub(super) use crate::diagnose::numbers::{
    in_mm, plain, signed, signed_with_sigma, trimmed, value_and_sigma,
};
use crate::{
    audit::Audit,
    calibrate::{Estimate, Model},
    depth::BoardDepth,
    diagnose::{Basis, Code, Finding, Quantity, Sensor, ToRecord, Unit, Verdict},
};

/// One line of the table of quantities.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Row {
    pub(super) quantity: String,
    pub(super) factory: String,
    pub(super) measured: String,
    pub(super) difference: String,
    /// The check that judges it, where one does.
    pub(super) verdict: Option<(Code, Verdict)>,
}

/// What stands above the first four columns.
pub(super) const HEADER: [&str; 4] = ["", "factory", "measured", "difference"];

/// True where the finding says something that the table of quantities must show.
fn has_a_row(finding: &Finding) -> bool {
    finding.quantity.is_some() || !matches!(finding.verdict, Verdict::Ok | Verdict::Info)
}

/// The checks without a row: nothing is wrong and there is no quantity to show. Those that are worth knowing, and those
/// that are merely OK.
pub(super) fn without_a_row(audit: &Audit) -> [Vec<&Finding>; 2] {
    [Verdict::Info, Verdict::Ok].map(|verdict| {
        audit.findings.iter().filter(|f| f.verdict == verdict && !has_a_row(f)).collect()
    })
}

/// The table of quantities: one row for each, and the error of the depth beside them; further rows for whatever else
/// is not in order.
pub(super) fn rows(audit: &Audit) -> Vec<Row> {
    let findings = audit.findings.iter().filter(|finding| has_a_row(finding));
    let mut rows: Vec<Row> = findings.map(row).collect();
    let error = |depth: Option<&BoardDepth>| {
        let estimate = depth.and_then(|depth| depth.mean_of_medians_m);
        estimate.map_or("—".to_owned(), |e| format!("{} mm", signed_with_sigma(in_mm(e), 2)))
    };
    if audit.factory_depth.is_some() || audit.own_depth.is_some() {
        let depth_row = Row {
            quantity: "Depth error (board − sensor)".to_owned(),
            factory: error(audit.factory_depth.as_ref()),
            measured: error(audit.own_depth.as_ref()),
            difference: frames_that_count(audit),
            verdict: None,
        };
        // Beside the other checks of the depth.
        let at =
            rows.iter().position(|row| row.verdict.is_some_and(|(code, _)| code >= Code::TD301));
        rows.insert(at.unwrap_or(rows.len()), depth_row);
    }
    rows
}

/// In how many frames the depth error was compared, where some had no corner with depth, or nothing but errors beyond
/// [`MAX_ERROR_M`](crate::depth::MAX_ERROR_M).
fn frames_that_count(audit: &Audit) -> String {
    let of = |depth: &BoardDepth| {
        (depth.frames.iter().filter(|f| f.median_error_m.is_some()).count(), depth.frames.len())
    };
    match (audit.factory_depth.as_ref().map(of), audit.own_depth.as_ref().map(of)) {
        (Some((a, n)), Some((b, m))) if n == m && (a, b) != (n, n) => {
            format!("in {a} and {b} of {n} frames")
        }
        _ => String::new(),
    }
}

fn row(finding: &Finding) -> Row {
    let verdict = Some((finding.code, finding.verdict));
    match &finding.quantity {
        Some(Quantity { name, factory, measured, difference: instead }) => Row {
            quantity: name.clone(),
            factory: factory.clone(),
            measured: measured.clone(),
            difference: instead.clone().unwrap_or_else(|| difference(finding)),
            verdict,
        },
        None => Row {
            quantity: finding.title().to_owned(),
            factory: String::new(),
            measured: fact(finding),
            difference: difference(finding),
            verdict,
        },
    }
}

/// A value that is no deviation: a number of things, an angle.
fn fact(finding: &Finding) -> String {
    match (finding.unit, finding.value) {
        (Unit::Count, Some(value)) => plain(value, 0),
        (Unit::Degrees, Some(value)) => format!("{} °", plain(value, 1)),
        _ => String::new(),
    }
}

/// The finding's value with its σ and unit, signed; nothing where the value is no deviation.
pub(super) fn difference(finding: &Finding) -> String {
    let Some(value) = finding.value.filter(|value| value.is_finite()) else { return String::new() };
    if matches!(finding.unit, Unit::Count | Unit::Degrees) {
        return String::new();
    }
    let sigma = finding.sigma.unwrap_or(f64::NAN);
    format!("{} {}", signed_with_sigma(Estimate { value, sigma }, 2), unit(finding.unit))
}

/// The unit as people write it.
pub(super) const fn unit(unit: Unit) -> &'static str {
    match unit {
        Unit::Degrees => "°",
        other => other.symbol(),
    }
}

/// The own focal length: as the check of the focal length judged it (its σ knows more than the fit's own), else as it
/// was calibrated or given.
pub(super) fn focal(audit: &Audit) -> Option<Estimate> {
    let check = audit.findings.iter().find(|finding| finding.code == Code::TD201);
    let judged = check
        .and_then(|finding| finding.evidence.iter().find(|evidence| evidence.name == "focal_px"));
    if let Some(evidence) = judged {
        return Some(Estimate { value: evidence.value, sigma: evidence.sigma.unwrap_or(f64::NAN) });
    }
    let calibrated = audit.calibration.as_ref().map(|calibration| {
        let sigma =
            calibration.parameters.iter().find(|p| p.name == "focal_px").map(|p| p.estimate.sigma);
        Estimate {
            value: calibration.camera.intrinsics.focal_px(),
            sigma: sigma.unwrap_or(f64::NAN),
        }
    });
    let given = || {
        audit
            .camera
            .as_ref()
            .map(|camera| Estimate { value: camera.intrinsics.focal_px(), sigma: f64::NAN })
    };
    calibrated.or_else(given)
}

/// The recording and its camera.
pub(super) fn device_line(audit: &Audit) -> String {
    format!("{} · {}", audit.name, camera_line(audit))
}

/// Which camera: what people most often do not know stands first.
pub(super) fn camera_line(audit: &Audit) -> String {
    let sensor = match audit.device.sensor {
        Sensor::TrueDepth => "TrueDepth (front camera)",
        Sensor::Lidar => "LiDAR (rear camera, not TrueDepth)",
        Sensor::Unknown => "unknown camera (the files do not say)",
    };
    let mut parts = vec![sensor.to_owned()];
    if audit.device.device_type.as_deref().is_some_and(|name| name.starts_with("AVCapture")) {
        parts.push("AVFoundation".to_owned());
    }
    if let Some(model) = audit.device.model {
        parts.push(format!("intrinsics of {model}"));
    }
    parts.join(" · ")
}

/// What was looked at.
pub(super) fn board_line(audit: &Audit) -> String {
    let board = &audit.board;
    let size = audit.frames.iter().find_map(|frame| frame.size_px);
    let size = size.map_or(String::new(), |[width, height]| format!(" of {width}x{height} px"));
    let n_seen = audit.n_frames_with_board();
    let used = match audit.n_frames_summarised() {
        0 => String::new(),
        n => format!(", of which the {} that differ most are used", n_seen - n),
    };
    format!(
        "{}{size}, board seen in {n_seen}{used} · {}x{} squares of {} mm, {}",
        count(audit.frames.len(), "frame"),
        board.squares_x,
        board.squares_y,
        trimmed(1e3 * board.square_m, 3),
        board.dictionary.name(),
    )
}

/// The outcome in one sentence.
pub(super) fn headline(audit: &Audit) -> (Verdict, String) {
    let number = |verdict| audit.findings.iter().filter(|f| f.verdict == verdict).count();
    let titles = |verdict| {
        let of_verdict = audit.findings.iter().filter(|f| f.verdict == verdict);
        of_verdict.map(|f| f.title().to_lowercase()).collect::<Vec<_>>().join(", ")
    };
    let [faults, warnings, unknown] =
        [Verdict::Fault, Verdict::Warning, Verdict::Unknown].map(number);
    let all = audit.findings.len();
    if all == 0 {
        return (Verdict::Unknown, "Nothing could be checked.".to_owned());
    }
    if faults > 0 {
        let titles = titles(Verdict::Fault);
        return (
            Verdict::Fault,
            format!("This recording has {}: {titles}.", count(faults, "fault")),
        );
    }
    let but = match (warnings, unknown) {
        (0, 0) => return (Verdict::Ok, "This recording shows no fault.".to_owned()),
        (0, 1) => format!("1 check cannot tell: {}.", titles(Verdict::Unknown)),
        (0, unknown) => format!("{unknown} of {all} checks cannot tell."),
        (warnings, _) => {
            format!("{}: {}.", count(warnings, "warning"), titles(Verdict::Warning))
        }
    };
    let verdict = if warnings > 0 { Verdict::Warning } else { Verdict::Unknown };
    (verdict, format!("No fault seen, but {but}"))
}

/// Checks that cannot tell, for one reason or with one remedy.
pub(super) struct CannotTell<'a> {
    /// By code.
    pub(super) findings: Vec<&'a Finding>,
    /// Why, where it is one reason for all that stands in none of their own words.
    pub(super) why: Option<String>,
    to_record: Option<ToRecord>,
    /// What to record, in a sentence.
    pub(super) what_to_do: &'a str,
}

/// What cannot be told, grouped: first all that waits for the camera where there is none, then by what to record.
pub(super) fn cannot_tell(audit: &Audit) -> Vec<CannotTell<'_>> {
    let mut groups: Vec<CannotTell<'_>> = Vec::new();
    for finding in audit.findings.iter().filter(|f| f.verdict == Verdict::Unknown) {
        let waits = finding.value.is_none() && finding.basis.needs_camera();
        let why = audit.no_calibration.as_ref().filter(|_| waits && audit.camera.is_none());
        let same = groups.iter_mut().find(|group| match why {
            Some(_) => group.why.is_some(),
            None => group.why.is_none() && group.to_record == finding.to_record,
        });
        match same {
            Some(group) => group.findings.push(finding),
            None => groups.push(CannotTell {
                findings: vec![finding],
                why: why.map(|why| format!("{}.", capitalised(why))),
                to_record: finding.to_record,
                what_to_do: &finding.what_to_do,
            }),
        }
    }
    groups
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// Faults first, each group by code.
pub(super) fn by_severity(audit: &Audit) -> Vec<&Finding> {
    let mut findings: Vec<&Finding> = audit.findings.iter().collect();
    findings.sort_by_key(|finding| (finding.verdict, finding.code));
    findings
}

/// The verdict as a word that needs no colour.
pub(super) const fn verdict_word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Fault => "FAULT",
        Verdict::Warning => "WARNING",
        Verdict::Unknown => "CANNOT TELL",
        Verdict::Info => "INFO",
        Verdict::Ok => "OK",
    }
}

/// How far the value is from what ought to be, in σ and in tolerances; nothing where it is no estimate.
pub(super) fn how_sure(finding: &Finding) -> Option<String> {
    let size = finding.value.filter(|value| value.is_finite())?.abs();
    let sigma = finding.sigma.filter(|sigma| sigma.is_finite() && *sigma > 0.0)?;
    let times = |ratio: f64| if ratio < 10.0 { plain(ratio, 1) } else { plain(ratio, 0) };
    let mut text = format!("{} σ from what ought to be", times(size / sigma));
    if let Some(tolerance) = finding.tolerance.filter(|t| t.is_finite() && *t > 0.0) {
        let bound = format!("±{} {}", trimmed(tolerance, 3), unit(finding.unit));
        text += &if size > tolerance {
            format!(", and {} times the tolerance of {bound}", times(size / tolerance))
        } else {
            format!("; the tolerance of {bound} is {} σ wide", times(tolerance / sigma))
        };
    }
    Some(text + ". A fault asks for more than 3 σ and more than the tolerance.")
}

/// The frames that a finding rests on; `None` where it rests on metadata alone or on none.
pub(super) fn frames_behind(audit: &Audit, basis: Basis) -> Option<Vec<usize>> {
    let frames: Vec<usize> = match (basis, &audit.registration) {
        (Basis::Metadata, _) => return None,
        (Basis::Board, _) => {
            let is_seen = |frame: &usize| audit.frames[*frame].observation.identity.is_some();
            (0..audit.frames.len()).filter(is_seen).collect()
        }
        (Basis::Views, _) => audit.calibration.as_ref()?.views.iter().map(|v| v.frame).collect(),
        // Those of the board's whole surface; without them, those with depth at the corners.
        (Basis::Depth, Some(registration)) => registration.frames.clone(),
        (Basis::Depth, None) => {
            let depth = audit.own_depth.as_ref().or(audit.factory_depth.as_ref())?;
            let used = depth.frames.iter().filter(|frame| frame.median_error_m.is_some());
            used.map(|frame| frame.frame).collect()
        }
    };
    (!frames.is_empty()).then_some(frames)
}

/// Ascending numbers with runs drawn together: `0–4, 7, 9`.
pub(super) fn ranges(numbers: &[usize]) -> String {
    let mut runs: Vec<[usize; 2]> = Vec::new();
    for &number in numbers {
        match runs.last_mut() {
            Some([_, last]) if *last + 1 == number => *last = number,
            _ => runs.push([number; 2]),
        }
    }
    let words = runs.into_iter().map(|[first, last]| {
        if first == last { first.to_string() } else { format!("{first}–{last}") }
    });
    words.collect::<Vec<_>>().join(", ")
}

/// A model as people say it.
pub(super) const fn model(model: Model) -> &'static str {
    match model {
        Model::Focal => "focal length only",
        Model::FocalTable => "focal length, Apple's table",
        Model::FocalCentre => "focal length and centre",
        Model::FocalTableCentre => "focal length and centre, Apple's table",
        Model::Brown => "Brown (k1 k2 p1 p2 k3)",
        Model::BrownAspect => "Brown (k1 k2 p1 p2 k3), fx and fy",
    }
}

/// A model in a few letters, for the margin of a figure.
pub(super) const fn model_short(model: Model) -> &'static str {
    match model {
        Model::Focal => "focal",
        Model::FocalTable => "focal, table",
        Model::FocalCentre => "focal, centre",
        Model::FocalTableCentre => "focal, centre, table",
        Model::Brown => "Brown",
        Model::BrownAspect => "Brown, fx, fy",
    }
}

/// With numbers kept on one line with their units and their σ, for running text.
pub(super) fn unbroken(text: &str) -> String {
    const UNITS: [&str; 6] = [" px", " %", " mm", " σ", " ±", " °"];
    let text = text.replace("± ", "±\u{a0}");
    UNITS.iter().fold(text, |text, unit| text.replace(unit, &unit.replace(' ', "\u{a0}")))
}

/// `1 frame`, `2 frames`.
pub(super) fn count(number: usize, noun: &str) -> String {
    format!("{number} {noun}{}", if number == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::Tolerances;

    #[test]
    fn what_speaks_for_a_verdict() {
        assert_eq!(ranges(&[0, 1, 2, 5, 7, 8]), "0–2, 5, 7–8");
        assert_eq!(ranges(&[]), "");

        let mut finding = Finding::new(Code::TD201, &Tolerances::default());
        (finding.value, finding.sigma, finding.tolerance) = (Some(-6.2), Some(0.05), Some(1.0));
        let words = how_sure(&finding).expect("an estimate");
        assert!(
            words.starts_with("124 σ from what ought to be, and 6.2 times the tolerance of ±1 %")
        );
        finding.value = Some(0.1);
        let words = how_sure(&finding).expect("an estimate");
        assert!(
            words.starts_with("2.0 σ from what ought to be; the tolerance of ±1 % is 20 σ wide")
        );
        finding.sigma = None;
        assert_eq!(how_sure(&finding), None);
    }

    #[test]
    fn running_text() {
        assert_eq!(unbroken("6.2 ± 0.1 % of 5 px"), "6.2\u{a0}±\u{a0}0.1\u{a0}% of 5\u{a0}px");
        assert_eq!([count(1, "frame"), count(0, "frame")], ["1 frame", "0 frames"]);
    }
}
