//! The page: verdicts first, then the figures, then the frames, then how it was made. One file that loads nothing.

mod gallery;

use maud::{DOCTYPE, Markup, PreEscaped, html};

pub use gallery::frames_to_show;

use super::{
    figures::{self, Figure},
    photo::Photo,
    words,
};
use crate::{
    audit::Audit,
    diagnose::{Correction, Finding, Verdict},
};

/// Nothing may be loaded, from anywhere: images come as `data:`, style and script stand in the page.
const POLICY: &str = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'; \
                      base-uri 'none'; form-action 'none'";

/// The report as one HTML file, with these images in its gallery (see [`frames_to_show`] for which to read).
///
/// Everything that comes out of a file is escaped. The same audit and photos give the same bytes.
pub fn page(audit: &Audit, photos: &[Photo]) -> String {
    let title = format!("{} · truedepth audit", audit.name);
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="generator" content=(concat!("truedepth ", env!("CARGO_PKG_VERSION")));
                title { (title) }
                style { (PreEscaped(include_str!("report.css"))) }
            }
            body {
                a class="skip" href="#findings" { "Skip to the findings" }
                (header(audit))
                main {
                    (verdicts(audit))
                    (quantities(audit))
                    @for (question, figures) in evidence(audit) {
                        @if !figures.is_empty() {
                            section class="evidence" {
                                h2 { (question) }
                                div class="figures" { @for figure in figures { (figure.to_html()) } }
                            }
                        }
                    }
                    (gallery::gallery(audit, photos))
                    (files(audit))
                }
                (footer(audit))
                div id="tip" role="status" aria-live="polite" hidden {}
                script { (PreEscaped(include_str!("report.js"))) }
            }
        }
    };
    markup.into_string()
}

/// The figures, by the question they answer.
fn evidence(audit: &Audit) -> [(&'static str, Vec<Figure>); 3] {
    let depth = figures::depth_histograms(audit)
        .into_iter()
        .chain(figures::error_histogram(audit))
        .chain(figures::error_by_frame(audit))
        .chain(figures::error_by_range(audit));
    let camera =
        [figures::focal_lengths(audit), figures::rms_by_lens(audit), figures::rms_by_model(audit)];
    let trust = [figures::residual_field(audit), figures::rms_by_view(audit)];
    [
        ("Is the depth true?", depth.collect()),
        ("Is the camera what the factory says?", camera.into_iter().flatten().collect()),
        ("Can the measurement be trusted?", trust.into_iter().flatten().collect()),
    ]
}

fn header(audit: &Audit) -> Markup {
    html! {
        header class="top" {
            div class="bar" {
                p class="brand" { "truedepth" span { " audit" } }
                button type="button" id="theme" aria-pressed="false" hidden { "Dark" }
            }
            h1 { (audit.name) }
            p class="device" { (words::camera_line(audit)) }
            p class="board" { (words::board_line(audit)) }
        }
    }
}

fn verdicts(audit: &Audit) -> Markup {
    let (verdict, headline) = words::headline(audit);
    let findings = words::by_severity(audit);
    let (loud, quiet): (Vec<&Finding>, Vec<&Finding>) = findings
        .into_iter()
        .partition(|f| matches!(f.verdict, Verdict::Fault | Verdict::Warning | Verdict::Unknown));
    html! {
        section id="findings" aria-labelledby="headline" {
            p id="headline" class=(format!("headline {}", verdict.name())) { (headline) }
            @for finding in &loud { (full_finding(finding)) }
            @if !quiet.is_empty() {
                ul class="quiet" {
                    @for finding in &quiet {
                        li {
                            (chip(finding.verdict))
                            span class="code" { (finding.code) }
                            div {
                                strong { (finding.title()) ". " } (words::unbroken(&finding.summary))
                                @if !finding.what_to_do.is_empty() { " " (words::unbroken(&finding.what_to_do)) }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Colour, shape and word say the same.
fn chip(verdict: Verdict) -> Markup {
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

fn full_finding(finding: &Finding) -> Markup {
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
                p class="summary" { (words::unbroken(&finding.summary)) }
                @if !finding.what_to_do.is_empty() {
                    p class="to-do" { strong { "What to do. " } (words::unbroken(&finding.what_to_do)) }
                }
                @if let Some(correction) = &finding.correction {
                    p class="correction" {
                        strong { "What would make it true. " }
                        (words::unbroken(&correction_words(correction)))
                    }
                }
                p class="command" {
                    "Read more: " code { (words::explain_command(finding)) }
                    button type="button" class="copy" data-copy=(words::explain_command(finding)) hidden { "Copy" }
                }
                @if !finding.evidence.is_empty() { (evidence_table(finding)) }
            }
        }
    }
}

fn evidence_table(finding: &Finding) -> Markup {
    html! {
        details class="data" {
            summary { "The numbers behind it" }
            div class="scroll" tabindex="0" role="region" aria-label="The numbers behind it" {
                table {
                    thead { tr { th scope="col" { "quantity" } th scope="col" { "value" } th scope="col" { "σ" } } }
                    tbody {
                        @for evidence in &finding.evidence {
                            tr {
                                td { (evidence.name.replace('_', " ")) }
                                td { (words::trimmed(evidence.value, 4)) }
                                td { (evidence.sigma.map_or(String::new(), |sigma| words::trimmed(sigma, 4))) }
                            }
                        }
                    }
                }
            }
        }
    }
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

fn quantities(audit: &Audit) -> Markup {
    html! {
        section class="quantities" aria-labelledby="quantities-title" {
            h2 id="quantities-title" { "The numbers" }
            div class="scroll" tabindex="0" role="region" aria-labelledby="quantities-title" {
                table {
                    thead {
                        tr {
                            th scope="col" { "quantity" }
                            @for title in &words::HEADER[1..] { th scope="col" class="number" { (title) } }
                            th scope="col" { "check" }
                            th scope="col" { "verdict" }
                        }
                    }
                    tbody {
                        @for row in words::rows(audit) {
                            tr {
                                th scope="row" { (row.quantity) }
                                @for (title, cell) in
                                    words::HEADER[1..].iter().zip([&row.factory, &row.measured, &row.difference])
                                {
                                    td class="number" data-title=(title) { (cell) }
                                }
                                @if let Some((code, verdict)) = row.verdict {
                                    td class="code" { (code) }
                                    td class="verdict" { (chip(verdict)) }
                                } @else { td {} td {} }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// What was odd, and how everything was computed.
fn files(audit: &Audit) -> Markup {
    html! {
        section class="files" {
            h2 { "The files, and how this was made" }
            @if audit.problems.is_empty() {
                p { "Nothing was odd in the files." }
            } @else {
                p { "Odd, but not fatal:" }
                ul { @for problem in &audit.problems { li { (problem) } } }
            }
            @if let Some(why) = &audit.no_calibration { p { "There is no calibration: " (why) } }
            dl {
                dt { "Verdicts" }
                dd {
                    "A fault is both beyond 3 σ and beyond the tolerance. OK means that a fault of that size would \
                     have been seen. What is neither is “cannot tell”, with what to record to be able to tell."
                }
                dt { "Depth error" }
                dd {
                    "Depth of the board by its pose minus depth of the sensor at the same corner, along the optical \
                     axis; errors beyond 20 mm dropped; median of each frame; mean of the medians."
                }
                dt { "Method" }
                dd {
                    (audit.method.name())
                    @if let Some(calibration) = &audit.calibration {
                        ", " (words::model(calibration.model)) ", " (words::count(calibration.views.len(), "view"))
                        ", RMS " (words::plain(calibration.rms_px, 3)) " px"
                    }
                }
                dt { "Pixels" }
                dd { "Integer coordinates are pixel centres, x to the right, y down." }
                dt { "After" }
                dd {
                    "Urban, Lindemeier, Dobbelstein, Haenel: On the Issues of TrueDepth Sensor Data for Computer \
                     Vision Tasks Across Different iPad Generations, arXiv:2201.10865."
                }
            }
        }
    }
}

fn footer(audit: &Audit) -> Markup {
    html! {
        footer {
            p {
                "truedepth " (env!("CARGO_PKG_VERSION")) " · the same numbers for programs: report.json, schema "
                code { "truedepth.audit/1" } " · " (words::count(audit.frames.len(), "frame"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sample;

    /// Elements that never have an end tag.
    const VOID: [&str; 3] = ["meta", "img", "input"];

    /// Every tag with its attributes as written, in order; style and script are passed over.
    fn tags(page: &str) -> Vec<&str> {
        let mut tags = Vec::new();
        let mut rest = page;
        while let Some(at) = rest.find('<') {
            let end = at + rest[at..].find('>').expect("every tag ends");
            let tag = &rest[at + 1..end];
            tags.push(tag);
            rest = &rest[end + 1..];
            for raw in ["style", "script"] {
                if tag == raw {
                    let close = format!("</{raw}>");
                    rest = &rest[rest.find(&close).expect("style and script end")..];
                }
            }
        }
        tags
    }

    fn name(tag: &str) -> &str {
        tag.trim_start_matches('/').split([' ', '\n']).next().expect("split gives something")
    }

    fn assert_well_formed(page: &str) {
        let mut open = Vec::new();
        for tag in tags(page).into_iter().filter(|tag| !tag.starts_with('!')) {
            if tag.starts_with('/') {
                assert_eq!(open.pop(), Some(name(tag)), "an end tag closes what was opened last");
            } else if !VOID.contains(&name(tag)) {
                open.push(name(tag));
            }
        }
        assert!(open.is_empty(), "left open: {open:?}");
    }

    fn without_style_and_script(page: &str) -> String {
        let mut text =
            page.replace(include_str!("report.css"), "").replace(include_str!("report.js"), "");
        while let Some(at) = text.find("data:image") {
            let end = at + text[at..].find('"').expect("attributes end");
            text.replace_range(at..end, "");
        }
        text
    }

    #[test]
    fn well_formed_and_alone() {
        let photos = sample::photos();
        let page = page(&sample::audit(), &photos);
        assert_well_formed(&page);
        assert!(!page.contains("http://") && !page.contains("https://"), "the page loads nothing");
        assert!(!page.contains("url(") && !page.contains("@import"), "the style loads nothing");
        let text = without_style_and_script(&page);
        for word in ["NaN", "inf ", "inf\"", "inf,", "Infinity"] {
            assert!(!text.contains(word), "{word} in the page");
        }
        let ids: Vec<&str> = tags(&page)
            .into_iter()
            .filter_map(|tag| {
                Some(tag.split_once(" id=\"")?.1.split('"').next().expect("split gives something"))
            })
            .collect();
        let mut unique = ids.clone();
        unique.sort_unstable();
        unique.dedup();
        assert_eq!(unique.len(), ids.len(), "{ids:?}");
        for figure in [
            "depth-factory",
            "depth-own",
            "depth-error",
            "depth-frames",
            "depth-range",
            "focal",
            "lens",
            "models",
            "residuals",
            "views",
            "frames",
        ] {
            assert!(ids.contains(&figure), "no figure {figure}");
        }
        assert!(page.len() < 1_000_000, "{} bytes", page.len());
    }

    #[test]
    fn every_image_and_drawing_has_words() {
        let page = page(&sample::audit(), &sample::photos());
        for tag in tags(&page).into_iter().filter(|tag| !tag.starts_with('/')) {
            match name(tag) {
                "img" => assert!(tag.contains(" alt=\""), "{tag}"),
                "svg" => assert!(tag.contains("aria-l") || tag.contains("aria-hidden"), "{tag}"),
                _ => (),
            }
        }
    }

    #[test]
    fn what_comes_from_a_file_is_text() {
        let mut audit = sample::audit();
        let evil = "<script>alert('\"&amp;')</script>";
        audit.name = evil.to_owned();
        audit.device.device_type = Some(evil.to_owned());
        audit.no_calibration = Some(evil.to_owned());
        for frame in &mut audit.frames {
            frame.color = Some(evil.to_owned());
        }
        let page = page(&audit, &sample::photos());
        assert_well_formed(&page);
        assert_eq!(page.matches("<script").count(), 1, "our own alone");
        assert!(page.contains("&lt;script&gt;alert('&quot;&amp;amp;')&lt;/script&gt;"));
    }

    #[test]
    fn nothing_known_is_a_page_too() {
        let mut audit = sample::audit();
        audit.factory = None;
        audit.calibration = None;
        audit.camera = None;
        audit.factory_depth = None;
        audit.own_depth = None;
        audit.findings.clear();
        audit.frames.clear();
        let page = page(&audit, &[]);
        assert_well_formed(&page);
        assert!(page.contains("Nothing could be checked."));
    }

    #[test]
    fn numbers_that_are_none_do_not_break_a_drawing() {
        let mut audit = sample::audit();
        let calibration = audit.calibration.as_mut().expect("the sample has one");
        for candidate in &mut calibration.candidates {
            candidate.held_out_rms_px = f64::NAN;
            candidate.focal_px.sigma = f64::INFINITY;
        }
        for view in &mut calibration.views {
            view.residuals_px[0] = [f64::NAN, 0.0];
        }
        for finding in &mut audit.findings {
            finding.value = Some(f64::NAN);
            finding.sigma = Some(f64::INFINITY);
        }
        let text = without_style_and_script(&page(&audit, &[]));
        assert!(!text.contains("NaN") && !text.contains(">inf"));
    }

    #[test]
    fn same_input_same_bytes() {
        assert_eq!(
            page(&sample::audit(), &sample::photos()),
            page(&sample::audit(), &sample::photos())
        );
    }
}
