//! Words and numbers as people read them; terminal and page say the same.

use super::svg::minus;
use crate::{
    audit::Audit,
    calibrate::{Estimate, Model},
    depth::BoardDepth,
    diagnose::{Code, Finding, Sensor, Unit, Verdict},
    math,
    recording::StreamState,
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

/// Checks of a quantity: they have a row of the table whatever their verdict.
const QUANTITIES: [Code; 9] = [
    Code::TD201,
    Code::TD202,
    Code::TD203,
    Code::TD301,
    Code::TD302,
    Code::TD303,
    Code::TD401,
    Code::TD402,
    Code::TD403,
];

/// True where the finding says something that the table of quantities must show.
fn has_a_row(finding: &Finding) -> bool {
    QUANTITIES.contains(&finding.code) || !matches!(finding.verdict, Verdict::Ok | Verdict::Info)
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
    let mut rows: Vec<Row> = findings.map(|finding| row(audit, finding)).collect();
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

fn row(audit: &Audit, finding: &Finding) -> Row {
    let dash = || "—".to_owned();
    let factory = audit.factory.as_ref().map(|factory| &factory.intrinsics);
    let judged =
        finding.value.map(|value| Estimate { value, sigma: finding.sigma.unwrap_or(f64::NAN) });
    let named = |name: &str| {
        let found = finding.evidence.iter().find(|evidence| evidence.name == name)?;
        Some(Estimate { value: found.value, sigma: found.sigma.unwrap_or(f64::NAN) })
    };
    let mut difference = difference(finding);
    let (factory, measured) = match finding.code {
        Code::TD201 => (
            factory.map_or_else(dash, |f| format!("{} px", plain(f.focal_px(), 2))),
            focal(audit).map_or_else(dash, |focal| format!("{} px", value_and_sigma(focal, 2))),
        ),
        Code::TD202 => {
            let both = named("center_x_px").zip(named("center_y_px"));
            let pair = |(x, y): (Estimate, Estimate)| {
                format!("{}, {} px", plain(x.value, 2), plain(y.value, 2))
            };
            (
                factory.map_or_else(dash, |f| format!("{}, {} px", plain(f.cx, 2), plain(f.cy, 2))),
                both.map_or_else(dash, pair),
            )
        }
        Code::TD203 => {
            let (color, depth) = (audit.distortion_state, audit.depth_distortion_state);
            let depth = match depth {
                StreamState::Unknown => String::new(),
                same if same == color => ", depth too".to_owned(),
                other => format!(", depth {}", other.name()),
            };
            (dash(), color.name().replace('_', " ") + &depth)
        }
        // The deviation that was judged (a slope or a mean ratio), so that both columns tell the same.
        Code::TD301 => {
            ("1".to_owned(), judged.map_or_else(dash, |d| value_and_sigma(as_scale(d), 4)))
        }
        Code::TD302 => (
            "0 mm".to_owned(),
            judged.map_or_else(dash, |d| format!("{} mm", value_and_sigma(d, 2))),
        ),
        Code::TD303 => {
            let noise = named("pixel_noise_mm").map(|e| format!("{} mm", plain(e.value, 2)));
            if judged.is_some() {
                let percent = judged.map_or(f64::NAN, |share| share.value);
                difference = format!("{} % holes", plain(percent, 2));
            }
            (String::new(), noise.map_or_else(dash, |noise| format!("{noise} noise")))
        }
        Code::TD401 => {
            ("1".to_owned(), judged.map_or_else(dash, |d| value_and_sigma(as_scale(d), 4)))
        }
        Code::TD402 => {
            let both = named("shift_x_px").zip(named("shift_y_px"));
            // With the σ of the difference in the next column; that of each axis stands in the evidence.
            let pair = |(x, y): (Estimate, Estimate)| {
                let decimals = if x.sigma.max(y.sigma) < 0.95 { 2 } else { 1 };
                format!("{}, {} px", signed(x.value, decimals), signed(y.value, decimals))
            };
            ("0, 0 px".to_owned(), both.map_or_else(dash, pair))
        }
        Code::TD403 => {
            let answer = |n: f64| {
                if n > 0.0 { format!("in {} frames", plain(n, 0)) } else { "no".to_owned() }
            };
            (String::new(), finding.value.map_or_else(dash, answer))
        }
        _ => (String::new(), fact(finding)),
    };
    let is_judged =
        |e: Estimate| judged.is_some_and(|judged| (judged.value - e.value).abs() < 1e-9);
    let quantity = match finding.code {
        Code::TD301 if named("ratio_at_center").is_some_and(|r| is_judged(as_percent(r))) => {
            "Depth scale (mean ratio)".to_owned()
        }
        Code::TD302 => match named("offset_at_center_m").zip(named("center_m")) {
            Some((offset, center)) if is_judged(in_mm(offset)) => {
                format!("Depth bias at {} m (sensor − board)", plain(center.value, 2))
            }
            _ => "Depth bias (sensor − board)".to_owned(),
        },
        _ => finding.title().to_owned(),
    };
    Row { quantity, factory, measured, difference, verdict: Some((finding.code, finding.verdict)) }
}

/// A deviation in percent as a factor.
fn as_scale(percent: Estimate) -> Estimate {
    Estimate { value: 1.0 + percent.value / 100.0, sigma: percent.sigma / 100.0 }
}

/// A factor as a deviation in percent.
fn as_percent(scale: Estimate) -> Estimate {
    Estimate { value: 100.0 * (scale.value - 1.0), sigma: 100.0 * scale.sigma }
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

/// Metres as millimetres.
pub(super) fn in_mm(estimate: Estimate) -> Estimate {
    Estimate { value: 1e3 * estimate.value, sigma: 1e3 * estimate.sigma }
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
    /// What to record.
    pub(super) what_to_do: &'a str,
}

/// What cannot be told, grouped: first all that waits for the camera where there is none, then by what to record.
pub(super) fn cannot_tell(audit: &Audit) -> Vec<CannotTell<'_>> {
    const NEED_THE_CAMERA: [Code; 9] = [
        Code::TD201,
        Code::TD202,
        Code::TD203,
        Code::TD204,
        Code::TD301,
        Code::TD302,
        Code::TD303,
        Code::TD401,
        Code::TD402,
    ];
    let mut groups: Vec<CannotTell<'_>> = Vec::new();
    for finding in audit.findings.iter().filter(|f| f.verdict == Verdict::Unknown) {
        let waits = finding.value.is_none() && NEED_THE_CAMERA.contains(&finding.code);
        let why = audit.no_calibration.as_ref().filter(|_| waits && audit.camera.is_none());
        let same = groups.iter_mut().find(|group| match why {
            Some(_) => group.why.is_some(),
            None => group.why.is_none() && group.what_to_do == finding.what_to_do,
        });
        match same {
            Some(group) => group.findings.push(finding),
            None => groups.push(CannotTell {
                findings: vec![finding],
                why: why.map(|why| format!("{}.", capitalised(why))),
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

/// A summary without the test that it ends with in parentheses, and the test.
pub(super) fn sentence_and_test(summary: &str) -> (String, Option<String>) {
    let parts = summary.strip_suffix(").").and_then(|rest| rest.rsplit_once(" ("));
    match parts {
        Some((sentence, test)) if !test.contains(')') => {
            (format!("{sentence}."), Some(format!("{}.", capitalised(test))))
        }
        _ => (summary.to_owned(), None),
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

/// The frames that a check rests on; `None` where it rests on metadata alone or on none.
pub(super) fn frames_behind(audit: &Audit, code: Code) -> Option<Vec<usize>> {
    // Those of the board's whole surface; without them, those with depth at the corners.
    let registered = || {
        if let Some(registration) = &audit.registration {
            return Some(registration.frames.clone());
        }
        let depth = audit.own_depth.as_ref().or(audit.factory_depth.as_ref())?;
        let used = depth.frames.iter().filter(|frame| frame.median_error_m.is_some());
        Some(used.map(|frame| frame.frame).collect())
    };
    let views = || Some(audit.calibration.as_ref()?.views.iter().map(|v| v.frame).collect());
    let seen = || {
        let is_seen = |frame: &usize| audit.frames[*frame].observation.identity.is_some();
        Some((0..audit.frames.len()).filter(is_seen).collect())
    };
    let frames: Vec<usize> = match code {
        Code::TD201 | Code::TD202 | Code::TD203 | Code::TD204 => views(),
        Code::TD301 | Code::TD302 | Code::TD303 | Code::TD401 | Code::TD402 => registered(),
        Code::TD403 => seen(),
        _ => None,
    }?;
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

/// The value and its σ, with two digits of the σ, and no more than `max_decimals` after the point. A σ that is not
/// finite is left out.
pub(super) fn value_and_sigma(estimate: Estimate, max_decimals: usize) -> String {
    let Estimate { value, sigma } = estimate;
    if !value.is_finite() {
        return "—".to_owned();
    }
    if !(sigma.is_finite() && sigma > 0.0) {
        return minus(&format!("{value:.max_decimals$}"));
    }
    let decimals = decimals_of_sigma(sigma).min(max_decimals);
    // A σ below the last digit shown is not zero: say that it is smaller.
    let smallest = math::pow(10.0, -(decimals as f64));
    let sigma = if sigma < 0.5 * smallest {
        format!("< {smallest:.decimals$}")
    } else {
        format!("{sigma:.decimals$}")
    };
    format!("{} ± {sigma}", minus(&format!("{value:.decimals$}")))
}

/// As [`value_and_sigma`], with a sign before what is positive.
pub(super) fn signed_with_sigma(estimate: Estimate, max_decimals: usize) -> String {
    let text = value_and_sigma(estimate, max_decimals);
    let value = text.split(' ').next().unwrap_or_default();
    let is_positive = !value.starts_with('−') && value.contains(|c: char| matches!(c, '1'..='9'));
    if is_positive { format!("+{text}") } else { text }
}

/// A sentence of a finding, which is plain ASCII, with the signs of print: ± and − and σ.
pub(super) fn typeset(text: &str) -> String {
    let text = text.replace("+-", "±").replace("sigma", "σ");
    let mut set = String::with_capacity(text.len());
    let mut before = ' ';
    let mut letters = text.chars().peekable();
    while let Some(letter) = letters.next() {
        let is_minus = letter == '-'
            && matches!(before, ' ' | '(')
            && letters.peek().is_some_and(char::is_ascii_digit);
        set.push(if is_minus { '−' } else { letter });
        before = letter;
    }
    set
}

/// As [`typeset`], with numbers kept on one line with their units and their σ, for running text.
pub(super) fn unbroken(text: &str) -> String {
    const UNITS: [&str; 6] = [" px", " %", " mm", " σ", " ±", " °"];
    let text = typeset(text).replace("± ", "±\u{a0}");
    UNITS.iter().fold(text, |text, unit| text.replace(unit, &unit.replace(' ', "\u{a0}")))
}

/// Digits after the point that show two digits of a σ.
fn decimals_of_sigma(sigma: f64) -> usize {
    // 0.0995 rounds to 0.10 and 9.95 to 10: the exponent is that of the rounded σ.
    let exponent = math::log10(sigma * 1.005).floor();
    (1.0 - exponent).max(0.0) as usize
}

/// The value with its sign, `+0.3` or `−6.2`.
pub(super) fn signed(value: f64, decimals: usize) -> String {
    let text = plain(value, decimals);
    let is_zero = !text.contains(|c: char| c.is_ascii_digit() && c != '0');
    if is_zero || text.starts_with('−') { text } else { format!("+{text}") }
}

/// The value, without a sign where it is positive; a dash where it is no number.
pub(super) fn plain(value: f64, decimals: usize) -> String {
    if value.is_finite() { minus(&format!("{value:.decimals$}")) } else { "—".to_owned() }
}

/// The value without zeros at its end.
pub(super) fn trimmed(value: f64, decimals: usize) -> String {
    let text = plain(value, decimals);
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// `1 frame`, `2 frames`.
pub(super) fn count(number: usize, noun: &str) -> String {
    format!("{number} {noun}{}", if number == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_follow_sigma() {
        for (value, sigma, expected) in [
            (530.0361, 0.352, "530.04 ± 0.35"),
            (530.0361, 0.0152, "530.036 ± 0.015"),
            (-6.214, 0.0996, "−6.21 ± 0.10"),
            (-6.214, 9.96, "−6 ± 10"),
            (-6.214, 120.0, "−6 ± 120"),
            (1.0, 0.0002, "1.000 ± < 0.001"),
            (1.0, 0.0, "1.000"),
            (1.0, f64::NAN, "1.000"),
            (-0.0001, 0.0001, "0.000 ± < 0.001"),
            (f64::NAN, 1.0, "—"),
        ] {
            assert_eq!(value_and_sigma(Estimate { value, sigma }, 3), expected);
        }
    }

    #[test]
    fn what_speaks_for_a_verdict() {
        let (sentence, test) = sentence_and_test("It is 3 (not 4) long (by a ruler; tolerance 1).");
        assert_eq!(sentence, "It is 3 (not 4) long.");
        assert_eq!(test.as_deref(), Some("By a ruler; tolerance 1."));
        assert_eq!(sentence_and_test("No test."), ("No test.".to_owned(), None));
        assert_eq!(sentence_and_test("(a) (b))."), ("(a) (b)).".to_owned(), None));
        assert_eq!(ranges(&[0, 1, 2, 5, 7, 8]), "0–2, 5, 7–8");
        assert_eq!(ranges(&[]), "");

        let mut finding = Finding::new(Code::TD201, Unit::Percent);
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
    fn signs_and_zeros() {
        assert_eq!([signed(0.26, 1), signed(-0.26, 1), signed(-0.01, 1)], ["+0.3", "−0.3", "0.0"]);
        let estimate = |value| Estimate { value, sigma: 0.25 };
        assert_eq!(
            [0.5, -0.5, 0.001].map(|value| signed_with_sigma(estimate(value), 1)),
            ["+0.5 ± 0.2", "−0.5 ± 0.2", "0.0 ± 0.2"]
        );
        assert_eq!(typeset("(-6.1 +- 0.1 %) 12-inch -x"), "(−6.1 ± 0.1 %) 12-inch -x");
        assert_eq!(unbroken("6.2 ± 0.1 % of 5 px"), "6.2\u{a0}±\u{a0}0.1\u{a0}% of 5\u{a0}px");
        assert_eq!([count(1, "frame"), count(0, "frame")], ["1 frame", "0 frames"]);
        assert_eq!(
            [trimmed(20.875, 3), trimmed(20.0, 3), trimmed(200.0, 0)],
            ["20.875", "20", "200"]
        );
    }
}
