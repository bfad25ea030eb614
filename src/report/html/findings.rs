//! The verdicts: what was found, what to do, what to type; then how sure it is, by which test, on which frames.

use maud::{Markup, html};

use crate::{
    audit::Audit,
    diagnose::{Evidence, Finding, Verdict},
    recording::Defect,
    report::{
        figures,
        next::{Typed, explain_command, next_steps},
        words,
    },
};

/// The outcome in one sentence, what to type next, what needs a reader at length, and the rest as a list.
pub(super) fn findings(audit: &Audit, typed: &Typed) -> Markup {
    let (verdict, headline) = words::headline(audit);
    let findings = words::by_severity(audit);
    let of = |wanted: &[Verdict]| -> Vec<&Finding> {
        findings.iter().copied().filter(|f| wanted.contains(&f.verdict)).collect()
    };
    let passed = of(&[Verdict::Ok]);
    let nothing_else = passed.len() == findings.len();
    html! {
        section id="findings" aria-labelledby="headline" {
            p id="headline" class=(format!("headline {}", verdict.name())) { (headline) }
            (next(audit, typed))
            @for finding in of(&[Verdict::Fault, Verdict::Warning]) { (full(audit, finding)) }
            @for group in words::cannot_tell(audit) { (cannot_tell(audit, &group)) }
            (list(audit, &of(&[Verdict::Info])))
            @if !passed.is_empty() {
                details class="passed" open[nothing_else] {
                    summary { (chip(Verdict::Ok)) " " (words::count(passed.len(), "check")) " passed" }
                    (list(audit, &passed))
                }
            }
        }
    }
}

/// What to type next, each command with a button that copies it.
fn next(audit: &Audit, typed: &Typed) -> Markup {
    let mut steps = next_steps(audit, typed);
    // Each finding has that beside it.
    steps.retain(|step| !step.command.contains(" explain "));
    html! {
        @if !steps.is_empty() {
            div class="next" role="group" aria-labelledby="next-title" {
                p id="next-title" { "What to type next" }
                dl {
                    @for step in &steps {
                        dt { "To " (step.to) }
                        dd { (command(&step.command)) }
                    }
                }
            }
        }
    }
}

fn command(command: &str) -> Markup {
    html! {
        code { (command) }
        button type="button" class="copy" data-copy=(command) aria-label=(format!("Copy {command}")) hidden { "Copy" }
    }
}

/// Running text: what stands between backticks is a command.
fn prose(text: &str) -> Markup {
    html! {
        @for (index, part) in text.split('`').enumerate() {
            @if index % 2 == 1 { code { (part) } } @else { (words::unbroken(part)) }
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
                p class="summary" { (prose(&finding.claim)) }
                @if !finding.what_to_do.is_empty() {
                    p class="to-do" { strong { "What to do. " } (prose(&finding.what_to_do)) }
                }
                @if let Some(defect) = &finding.defect {
                    p class="correction" {
                        strong { "The correction. " }
                        (words::unbroken(&correction_words(defect)))
                    }
                }
                (evidence(audit, finding))
                p class="command" { "Read more: " (command(&explain_command(finding))) }
            }
        }
    }
}

/// Checks that cannot tell, for one reason or with one remedy.
fn cannot_tell(audit: &Audit, group: &words::CannotTell<'_>) -> Markup {
    let titles: Vec<String> = group
        .findings
        .iter()
        .enumerate()
        .map(|(i, f)| if i == 0 { f.title().to_owned() } else { f.title().to_lowercase() })
        .collect();
    let title = match titles.len() {
        0..=3 => titles.join(", "),
        n => format!("{n} checks"),
    };
    html! {
        article class="finding unknown group" {
            header {
                (chip(Verdict::Unknown))
                h2 { (title) }
            }
            div class="words" {
                @if let Some(why) = &group.why { p class="summary" { (prose(why)) } }
                @if !group.what_to_do.is_empty() {
                    p class="to-do" {
                        strong { "What to record. " } (prose(group.what_to_do))
                        @if audit.calibration.is_none() && figures::view_angles(audit).is_some() {
                            " " a href="#angles" { "From which sides the board was seen so far." }
                        }
                    }
                }
            }
            ul class=(if group.why.is_some() { "checks waiting" } else { "checks" }) {
                @for finding in &group.findings {
                    li id=(finding.code.name()) {
                        span class="code" { (finding.code) }
                        @if group.why.is_some() {
                            details class="data" {
                                summary { (finding.title()) }
                                p { (prose(&finding.claim)) }
                                (evidence(audit, finding))
                            }
                        } @else { (open_question(audit, finding)) }
                    }
                }
            }
        }
    }
}

/// A check that has a number, if not one that decides.
fn open_question(audit: &Audit, finding: &Finding) -> Markup {
    let difference = words::difference(finding);
    html! {
        div {
            p { (prose(&finding.claim)) }
            details class="data" { summary { "Evidence" } (evidence(audit, finding)) }
        }
        div class="measure" {
            @if !difference.is_empty() { p class="value" { (difference) } }
            @if let Some(gauge) = figures::finding_gauge(finding) { (gauge) }
        }
    }
}

/// Findings that need no reader: a line each, which opens.
fn list(audit: &Audit, findings: &[&Finding]) -> Markup {
    html! {
        @if !findings.is_empty() {
            ul class="quiet" {
                @for finding in findings {
                    li id=(finding.code.name()) {
                        details {
                            summary {
                                (chip(finding.verdict))
                                span class="code" { (finding.code) }
                                span {
                                    strong { (finding.title()) ". " } (prose(&finding.claim))
                                    @if !finding.what_to_do.is_empty() { " " (prose(&finding.what_to_do)) }
                                }
                            }
                            @if let Some(defect) = &finding.defect {
                                p class="correction" {
                                    strong { "The correction. " }
                                    (words::unbroken(&correction_words(defect)))
                                    " Made only with " code { "--within-tolerance" } "."
                                }
                            }
                            (evidence(audit, finding))
                        }
                    }
                }
            }
        }
    }
}

/// How sure, by which test, on which frames, with which numbers.
fn evidence(audit: &Audit, finding: &Finding) -> Markup {
    let test = Some(&finding.test).filter(|test| !test.is_empty());
    let how_sure = words::how_sure(finding);
    let frames = words::frames_behind(audit, finding.basis);
    let is_bare =
        how_sure.is_none() && test.is_none() && frames.is_none() && finding.evidence.is_empty();
    html! {
        @if is_bare && finding.verdict != Verdict::Unknown {
            p class="evidence-list" { "It follows from the files alone; there are no further numbers." }
        }
        @if how_sure.is_some() || test.is_some() || frames.is_some() {
            dl class="evidence-list" {
                @if let Some(how_sure) = how_sure { dt { "How sure" } dd { (words::unbroken(&how_sure)) } }
                @if let Some(test) = test { dt { "Test" } dd { (words::unbroken(test)) } }
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

/// What removes a defect, in a sentence.
fn correction_words(defect: &Defect) -> String {
    let what = match *defect {
        Defect::Focal { ratio } => {
            format!("Divide the focal length of the metadata by {}.", words::plain(ratio, 5))
        }
        Defect::Center { shift_px: [x, y] } => format!(
            "Move the principal point of the metadata by ({}, {}) px.",
            words::signed(-x, 2),
            words::signed(-y, 2)
        ),
        Defect::IntrinsicsScale { factor: [x, y] } => format!(
            "Multiply fx and cx by {}, fy and cy by {}.",
            words::trimmed(x, 5),
            words::trimmed(y, 5)
        ),
        Defect::Distorted => {
            "Resample the images to straight lines with the tables of this recording, where it \
                              has none with the own camera model."
                .to_owned()
        }
        Defect::RectifiedTwice => {
            "Resample the images with the tables of this recording, backwards.".to_owned()
        }
        Defect::DepthScale { ratio } => {
            format!("Divide every depth by {}.", words::plain(ratio, 5))
        }
        Defect::DepthBias { bias_m } => {
            format!("Take {} mm from every depth.", words::plain(1e3 * bias_m, 2))
        }
        Defect::DepthZoom { zoom: [x, _] } => format!(
            "Resample depth to colour: zoom {} about the principal point.",
            words::plain(x, 4)
        ),
        Defect::DepthShift { shift_px: [x, y] } => format!(
            "Resample depth to colour: it lies {} px too far right and {} px too far down.",
            words::plain(x, 2),
            words::plain(y, 2)
        ),
        Defect::Mirrored => "Mirror the images back.".to_owned(),
        Defect::DepthMirrored => "Mirror the depth maps back.".to_owned(),
    };
    let kind = if defect.is_in_data() {
        "It changes the images or the depth."
    } else {
        "It changes metadata only."
    };
    format!("{what} {kind}")
}
