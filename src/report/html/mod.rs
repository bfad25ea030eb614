//! The page: verdicts first, then the figures, then the frames, then how it was made. One file that loads nothing.

mod closeups;
mod findings;
mod gallery;
mod script;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use self::{findings::chip, script::SCRIPT};
use super::{
    figures::{self, Figure},
    next::{Typed, known_of_this_camera},
    pictures::Pictures,
    words,
};
use crate::{audit::Audit, par};

/// Nothing may be loaded, from anywhere: images come as `data:`, style and script stand in the page.
const POLICY: &str = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; \
                                 script-src 'unsafe-inline'; base-uri 'none'; form-action 'none'";

/// The head of every page: the same look and the same policy, with what this page adds to the style.
pub(super) fn head(title: &str, style: &str) -> Markup {
    html! {
        head {
            meta charset="utf-8";
            meta name="viewport" content="width=device-width, initial-scale=1";
            meta name="color-scheme" content="light dark";
            meta http-equiv="Content-Security-Policy" content=(POLICY);
            meta name="generator" content=(concat!("truedepth ", env!("CARGO_PKG_VERSION")));
            title { (title) }
            style { (PreEscaped(include_str!("report.css"))) (PreEscaped(style)) }
        }
    }
}

/// The report as one HTML file, with these pictures of the recording (without any it is the numbers alone) and the
/// commands that follow from what was typed.
///
/// Everything that comes out of a file is escaped. The same audit and pictures give the same bytes.
pub fn page(audit: &Audit, pictures: &Pictures, typed: &Typed) -> String {
    let title = format!("{} · truedepth audit", audit.name);
    let (evidence, (closeups, gallery)) = par::join(
        || evidence(audit),
        || {
            par::join(
                || closeups::closeups(audit, pictures),
                || gallery::gallery(audit, &pictures.photos),
            )
        },
    );
    let mut parts = vec![("findings", "Findings"), ("numbers", "Numbers")];
    parts.extend(closeups.as_ref().map(|_| ("closer", "Look")));
    parts.extend(evidence.iter().filter(|e| !e.3.is_empty()).map(|(id, name, ..)| (*id, *name)));
    parts.extend(gallery.as_ref().map(|_| ("frames", "Frames")));
    parts.push(("method", "Method"));
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            (head(&title, ""))
            body {
                a class="skip" href="#findings" { "Skip to the findings" }
                (header(audit, &parts))
                main {
                    (findings::findings(audit, typed))
                    (quantities(audit))
                    @if let Some(closeups) = closeups { (closeups) }
                    @for (id, _, question, figures) in evidence {
                        @if !figures.is_empty() {
                            section class="evidence" id=(id) {
                                h2 { (question) }
                                div class="figures" { @for figure in figures { (figure) } }
                            }
                        }
                    }
                    @if let Some(gallery) = gallery { (gallery) }
                    (files(audit))
                }
                (footer(audit))
                div id="tip" role="status" aria-live="polite" hidden {}
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    markup.into_string()
}

/// The figures, by the question they answer: id, name in the list of parts, question, figures.
fn evidence(audit: &Audit) -> [(&'static str, &'static str, &'static str, Vec<Markup>); 3] {
    let depth = figures::depth_histograms(audit)
        .into_iter()
        .chain(figures::error_histogram(audit))
        .chain(figures::error_by_frame(audit))
        .chain(figures::error_by_range(audit))
        .chain(figures::error_map(audit))
        .chain(figures::pattern_map(audit))
        .chain(figures::noise_map(audit));
    let camera = [
        figures::focal_lengths(audit),
        figures::rms_by_lens(audit),
        figures::rms_by_model(audit),
        figures::projection_uncertainty(audit),
    ];
    let trust = [
        figures::residual_field(audit),
        figures::rms_by_view(audit),
        figures::image_coverage(audit),
        figures::view_angles(audit),
        figures::board_shape(audit),
    ];
    [
        ("depth", "Depth", "Is the depth true?", drawn(depth)),
        (
            "camera",
            "Camera",
            "Is the camera what the factory says?",
            drawn(camera.into_iter().flatten()),
        ),
        ("trust", "Trust", "Can the measurement be trusted?", drawn(trust.into_iter().flatten())),
    ]
}

fn drawn(figures: impl Iterator<Item = Figure>) -> Vec<Markup> {
    figures.map(|figure| figure.to_html()).collect()
}

fn header(audit: &Audit, parts: &[(&str, &str)]) -> Markup {
    html! {
        header class="top" {
            div class="bar" {
                p class="brand" { "truedepth" span { " audit" } }
                button type="button" id="theme" aria-pressed="false" hidden { "Dark" }
            }
            h1 { (audit.name) }
            p class="device" { (words::camera_line(audit)) }
            p class="board" { (words::board_line(audit)) }
            @if let Some(known) = known_of_this_camera(audit) { p class="known" { (known) } }
            nav aria-label="Parts of this page" {
                @for (id, words) in parts { a href=(format!("#{id}")) { (words) } " " }
            }
        }
    }
}

fn quantities(audit: &Audit) -> Markup {
    html! {
        section class="quantities" id="numbers" aria-labelledby="quantities-title" {
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
        section class="files" id="method" {
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

    fn page(audit: &Audit, pictures: &Pictures) -> String {
        super::page(audit, pictures, &Typed::of(audit))
    }

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
        let mut text = page.replace(include_str!("report.css"), "").replace(SCRIPT, "");
        while let Some(at) = text.find("data:image") {
            let end = at + text[at..].find('"').expect("attributes end");
            text.replace_range(at..end, "");
        }
        text
    }

    #[test]
    fn well_formed_and_alone() {
        let pictures = sample::pictures();
        let page = page(&sample::rich_audit(), &pictures);
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
        let shown: Vec<&str> = ids.into_iter().filter(|id| figures::FIGURES.contains(id)).collect();
        assert_eq!(shown, figures::FIGURES);
        assert!(page.len() < 1_000_000, "{} bytes", page.len());
    }

    #[test]
    fn every_image_and_drawing_has_words() {
        let page = page(&sample::rich_audit(), &sample::pictures());
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
        audit.measured.name = evil.to_owned();
        audit.device.device_type = Some(evil.to_owned());
        audit.measured.no_calibration = Some(evil.to_owned());
        for frame in &mut audit.measured.frames {
            frame.color = Some(evil.to_owned());
        }
        let page = page(&audit, &sample::pictures());
        assert_well_formed(&page);
        assert_eq!(page.matches("<script").count(), 2, "our own script and its data alone");
        assert!(page.contains("&lt;script&gt;alert('&quot;&amp;amp;')&lt;/script&gt;"));
    }

    #[test]
    fn nothing_known_is_a_page_too() {
        let mut audit = sample::audit();
        audit.measured.factory = None;
        audit.measured.calibration = None;
        audit.measured.camera = None;
        audit.measured.factory_depth = None;
        audit.measured.own_depth = None;
        audit.findings.clear();
        audit.measured.frames.clear();
        let page = page(&audit, &Pictures::default());
        assert_well_formed(&page);
        assert!(page.contains("Nothing could be checked."));
    }

    #[test]
    fn numbers_that_are_none_do_not_break_a_drawing() {
        let mut audit = sample::rich_audit();
        let calibration = audit.measured.calibration.as_mut().expect("the sample has one");
        for candidate in &mut calibration.candidates {
            candidate.held_out_rms_px = f64::NAN;
            candidate.focal_px.sigma = f64::INFINITY;
        }
        for view in &mut calibration.views {
            view.residuals_px[0] = [f64::NAN, 0.0];
        }
        calibration.surface.as_mut().expect("the sample has one").heights_m[3] = f64::NAN;
        let registration = audit.measured.registration.as_mut().expect("the sample has one");
        registration.pattern.cells.iter_mut().for_each(|cell| cell.median_m = f64::NAN);
        for finding in &mut audit.findings {
            finding.value = Some(f64::NAN);
            finding.sigma = Some(f64::INFINITY);
        }
        let text = without_style_and_script(&page(&audit, &Pictures::default()));
        assert!(!text.contains("NaN") && !text.contains(">inf"));
    }

    #[test]
    fn same_input_same_bytes() {
        assert_eq!(
            page(&sample::audit(), &sample::pictures()),
            page(&sample::audit(), &sample::pictures())
        );
    }
}
