//! The verdicts: what was found, what to do, what to type; then how sure it is, by which test, on which frames.

use maud::{Markup, html};

use crate::{
    audit::Audit,
    diagnose::{Correction, Evidence, Finding, Verdict},
    report::{figures, words},
};

/// The outcome in one sentence, what needs a reader at length, and the rest as a list.
pub(super) fn findings(audit: &Audit) -> Markup {
    let (verdict, headline) = words::headline(audit);
    let findings = words::by_severity(audit);
    let (loud, quiet): (Vec<&Finding>, Vec<&Finding>) = findings
        .into_iter()
        .partition(|f| matches!(f.verdict, Verdict::Fault | Verdict::Warning | Verdict::Unknown));
    html! {
        section id="findings" aria-labelledby="headline" {
            p id="headline" class=(format!("headline {}", verdict.name())) { (headline) }
            @for finding in &loud { (full(audit, finding)) }
            @if !quiet.is_empty() {
                ul class="quiet" { @for finding in &quiet { li id=(finding.code.name()) { (short(audit, finding)) } } }
            }
        }
    }
}

/// Colour, shape and word say the same.
pub(super) fn chip(verdict: Verdict) -> Markup {
    let path = match verdict {
        Verdict::Fault => "M4 4L12 12M12 4L4 12",
        Verdict::Warning => "M8 3V9M8 12.2V12.8",
        Verdict::Unknown => "M5.5 6A2.5 2.5 0 1 1 8 8.6V9.4M8 12.2V12.8",
        Verdict::Info => "M8 7V13M8 3.4V4",
        Verdict::Ok => "M3.5 8.5L6.8 11.8L12.5 4.8",
    };
    html! {
        span class=(format!("chip {}", verdict.name())) {
            svg viewBox="0 0 16 16" aria-hidden="true" { path d=(path) {} }
            (words::verdict_word(verdict))
        }
    }
}

fn full(audit: &Audit, finding: &Finding) -> Markup {
    let difference = words::difference(finding);
    let (sentence, _) = words::sentence_and_test(&finding.summary);
    html! {
        article class=(format!("finding {}", finding.verdict.name())) id=(finding.code.name()) {
            header {
                (chip(finding.verdict))
                h2 { (finding.title()) }
                span class="code" { (finding.code) }
            }
            div class="measure" {
                @if !difference.is_empty() { p class="value" { (difference) } }
                @if let Some(gauge) = figures::finding_gauge(finding) { (gauge) }
            }
            div class="words" {
                p class="summary" { (words::unbroken(&sentence)) }
                @if !finding.what_to_do.is_empty() {
                    p class="to-do" { strong { "What to do. " } (words::unbroken(&finding.what_to_do)) }
                }
                @if let Some(correction) = &finding.correction {
                    p class="correction" {
                        strong { "What would make it true. " }
                        (words::unbroken(&correction_words(correction)))
                    }
                }
                @for (command, what_for) in words::next_commands(audit, finding) {
                    p class="command" {
                        (what_for) ": " code { (command) }
                        button type="button" class="copy" data-copy=(command) hidden { "Copy" }
                    }
                }
                (evidence(audit, finding))
            }
        }
    }
}

fn short(audit: &Audit, finding: &Finding) -> Markup {
    let (sentence, _) = words::sentence_and_test(&finding.summary);
    html! {
        (chip(finding.verdict))
        span class="code" { (finding.code) }
        div {
            strong { (finding.title()) ". " } (words::unbroken(&sentence))
            @if !finding.what_to_do.is_empty() { " " (words::unbroken(&finding.what_to_do)) }
            details class="data" {
                summary { "Evidence" }
                (evidence(audit, finding))
            }
        }
    }
}

/// How sure, by which test, on which frames, with which numbers.
fn evidence(audit: &Audit, finding: &Finding) -> Markup {
    let (_, test) = words::sentence_and_test(&finding.summary);
    let how_sure = words::how_sure(finding);
    let frames = words::frames_behind(audit, finding.code);
    html! {
        @if how_sure.is_some() || test.is_some() || frames.is_some() {
            dl class="evidence-list" {
                @if let Some(how_sure) = how_sure { dt { "How sure" } dd { (words::unbroken(&how_sure)) } }
                @if let Some(test) = test { dt { "Test" } dd { (words::unbroken(&test)) } }
                @if let Some(frames) = frames {
                    dt { "Frames" }
                    dd { (words::count(frames.len(), "frame")) ": " (words::ranges(&frames)) }
                }
            }
        }
        @if !finding.evidence.is_empty() { (evidence_table(finding)) }
    }
}

fn evidence_table(finding: &Finding) -> Markup {
    let row = |evidence: &Evidence| {
        let sigma = evidence.sigma.map_or(String::new(), |sigma| words::trimmed(sigma, 4));
        vec![evidence.name.replace('_', " "), words::trimmed(evidence.value, 4), sigma]
    };
    let table = figures::Table {
        header: vec!["quantity", "value", "σ"],
        rows: finding.evidence.iter().map(row).collect(),
    };
    table.to_html("The numbers behind it")
}

/// What a correction does, in a sentence.
fn correction_words(correction: &Correction) -> String {
    let what = match correction {
        Correction::Focal { focal_px } => {
            format!(
                "Use a focal length of {} px at the size of these images.",
                words::plain(*focal_px, 2)
            )
        }
        Correction::PrincipalPoint { center_px: [x, y] } => format!(
            "Use the principal point ({}, {}) px at the size of these images.",
            words::plain(*x, 2),
            words::plain(*y, 2)
        ),
        Correction::Undistort { tables: Some(_) } => {
            "Resample the images to straight lines with the tables of this recording.".to_owned()
        }
        Correction::Undistort { tables: None } => {
            "Resample the images to straight lines with the own camera model.".to_owned()
        }
        Correction::Depth { scale, bias_m } => format!(
            "Take {} mm from every depth, then divide it by {}.",
            words::plain(1e3 * bias_m, 2),
            words::plain(*scale, 5)
        ),
        Correction::Align { zoom, shift_px: [x, y] } => format!(
            "Resample depth to colour: zoom {}, shift {} px to the right and {} px down.",
            words::plain(*zoom, 4),
            words::plain(*x, 2),
            words::plain(*y, 2)
        ),
        Correction::Unmirror => "Mirror the images back.".to_owned(),
        Correction::UnmirrorDepth => "Mirror the depth maps back.".to_owned(),
        Correction::ScaleIntrinsics { factor: [x, y] } => format!(
            "Multiply fx and cx by {}, fy and cy by {}.",
            words::trimmed(*x, 5),
            words::trimmed(*y, 5)
        ),
    };
    let kind = if correction.changes_data() {
        "It changes the images or the depth."
    } else {
        "It changes metadata only."
    };
    format!("{what} {kind}")
}
